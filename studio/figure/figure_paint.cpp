// SPDX-License-Identifier: LGPL-2.1-or-later
// The colours of the figure, as a function of the position at rest. No green and no blue, so that
// both kinds of screen can be keyed.
#include <algorithm>
#include <cmath>

#include "base/srgb.h"
#include "studio/figure/figure.h"

namespace polyhull {
namespace {

/// Linear value of an sRGB colour given as 0xRRGGBB.
Vec3f code(std::uint32_t rgb) {
  return srgb_decoded(Vec3f(rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255) / 255.0f);
}

struct Palette {
  Vec3f skin = code(0xe3ab86), cheek = code(0xe08f76), lip = code(0xa8484a), hair = code(0x4a2c1c),
        hair_light = code(0x6b4128), eye = code(0xf4efe6), iris = code(0x6b4423),
        pupil = code(0x120c0a), brow = code(0x3a2216), band = code(0xb3262e),
        shirt = code(0xc23a2b), stripe = code(0xf3e6cc), collar = code(0x8f241c),
        logo = code(0xf0b429), letter = code(0x5a1a16), trousers = code(0x51464a),
        seam = code(0xd9a441), belt = code(0x2b1d16), buckle = code(0xe8c872),
        shoe = code(0xe0962d), sole = code(0xf2ede4), lace = code(0xf6f2ea), nail = code(0xc26a62),
        crease = code(0xb9825f), shade = code(0x3c3337);
};
const Palette palette;

/// 1 where x < 0, 0 where x > 0, over \p width.
[[gnu::always_inline]] inline float below(float x, float width) {
  return std::clamp(0.5f - x / width, 0.0f, 1.0f);
}

/// Coverage of the band |x| < half, right on average also where it is narrower than \p width.
[[gnu::always_inline]] inline float band(float x, float half, float width) {
  return std::max(below(x - half, width) - below(x + half, width), 0.0f);
}

void lay(Vec3f& colour, const Vec3f& over, float cover) {
  colour += (over - colour) * cover;
}

/// floor() of small numbers, which is asked for per pixel.
float whole_below(float x) {
  const auto whole = static_cast<float>(static_cast<int>(x));
  return whole > x ? whole - 1.0f : whole;
}

/// Share of a periodic stripe pattern with \p period of which the first \p part is on, averaged.
float stripes(float x, float period, float part, float width) {
  const auto integral = [&](float s) {
    const float n = whole_below(s);
    return n * part + std::min(s - n, part);
  };
  const float w = std::max(width / period, 1e-4f), s = x / period;
  return (integral(s + 0.5f * w) - integral(s - 0.5f * w)) / w;
}

float ellipse(float x, float y, float rx, float ry, float width) {
  const float k = std::sqrt(x * x / (rx * rx) + y * y / (ry * ry));
  return below((k - 1.0f) * std::min(rx, ry), width);
}

Vec3f head(const Vec3f& p, float w) {
  Vec3f colour = palette.skin;
  const float ax = std::abs(p.x);
  if (p.z > 0.02f) {
    lay(colour, palette.cheek, 0.5f * ellipse(ax - 0.038f, p.y - 1.603f, 0.020f, 0.016f, 0.016f));
    // Mouth: upper and lower lip with a dark line that rises at the corners.
    const float smile = 1.568f + 4.0f * ax * ax;
    lay(colour, palette.lip,
        below(ax - 0.024f, w) * band(p.y - smile, 0.0062f * (1.0f - ax / 0.030f) + 0.0012f, w));
    lay(colour, palette.pupil, 0.7f * below(ax - 0.023f, w) * band(p.y - smile, 0.0008f, w));
    lay(colour, palette.crease, 0.7f * ellipse(ax - 0.006f, p.y - 1.598f, 0.003f, 0.0022f, w));
    const float ex = ax - 0.031f, ey = p.y - 1.641f;
    lay(colour, palette.crease, 0.6f * ellipse(ex, ey, 0.0185f, 0.0115f, w));
    lay(colour, palette.eye, ellipse(ex, ey, 0.0165f, 0.0090f, w));
    const float inside = ellipse(ex, ey, 0.0165f, 0.0090f, w);
    lay(colour, palette.iris, inside * ellipse(ex, ey, 0.0078f, 0.0078f, w));
    lay(colour, palette.pupil, inside * ellipse(ex, ey, 0.0040f, 0.0040f, w));
    const float lid =
        1.641f + 0.0090f * std::sqrt(std::max(1.0f - ex * ex / (0.0175f * 0.0175f), 0.0f));
    lay(colour, palette.pupil, below(std::abs(ex) - 0.0170f, w) * band(p.y - lid, 0.0015f, w));
    const float arch = 1.664f - 9.0f * (ax - 0.034f) * (ax - 0.034f);
    lay(colour, palette.brow, band(ax - 0.033f, 0.018f, w) * band(p.y - arch, 0.0030f, w));
  }
  // Hair: everything behind the hairline, which leaves the ears free.
  const float line =
      glm::dot(glm::normalize(Vec3f(0.0f, -0.62f, 0.78f)), p - Vec3f(0.0f, 1.690f, 0.064f));
  const float ear = ellipse(p.z + 0.004f, p.y - 1.623f, 0.024f, 0.034f, w) * below(0.070f - ax, w);
  float hair = below(line - 0.001f, w) * (1.0f - ear);
  // The nape is bare below a line that rises towards the ears.
  hair *= below(1.560f + 0.3f * std::max(p.z + 0.08f, 0.0f) - p.y, w);
  // Side locks end in front of the ears.
  hair *= 1.0f - below(0.012f - p.z, w) * below(p.y - 1.640f, w);
  // The fringe.
  const Vec3f q = (p - Vec3f(0.014f, 1.722f, 0.048f)) / Vec3f(0.064f, 0.036f, 0.048f);
  hair = std::max(hair, below((glm::length(q) - 1.02f) * 0.036f, w));
  Vec3f strand = palette.hair;
  const float angle = std::atan2(p.x, p.z + 0.02f) + 6.0f * (p.y - 1.6f) * p.x;
  lay(strand, palette.hair_light,
      0.55f * stripes(angle * 0.09f, 0.0105f, 0.45f, std::max(w, 0.002f)));
  lay(colour, strand, hair);
  return colour;
}

Vec3f ponytail(const Vec3f& p, float w) {
  Vec3f colour = palette.hair;
  const float angle = std::atan2(p.x, p.z + 0.18f);
  lay(colour, palette.hair_light,
      0.55f * stripes(angle * 0.04f, 0.0105f, 0.45f, std::max(w, 0.002f)));
  lay(colour, palette.band, band(p.z + 0.132f, 0.009f, w) * below(1.66f - p.y, w));
  return colour;
}

/// A letter P in a disc on the chest and a number seven on the back.
void emblem(Vec3f& colour, const Vec3f& p, float w) {
  if (p.z > 0.03f) {
    const float x = p.x, y = p.y - 1.285f;
    // Nothing of it reaches farther.
    if (x * x + y * y > (0.064f + w) * (0.064f + w)) return;
    lay(colour, palette.logo, ellipse(x, y, 0.062f, 0.062f, w));
    lay(colour, palette.letter,
        ellipse(x, y, 0.058f, 0.058f, w) - ellipse(x, y, 0.053f, 0.053f, w));
    lay(colour, palette.letter, band(x + 0.017f, 0.007f, w) * band(y, 0.036f, w));
    const float bowl = ellipse(x + 0.008f, y - 0.014f, 0.034f, 0.022f, w) -
                       ellipse(x + 0.008f, y - 0.014f, 0.020f, 0.0095f, w);
    lay(colour, palette.letter, bowl * below(-0.017f - x, w));
  } else if (p.z < -0.03f) {
    const float x = -p.x, y = p.y - 1.270f;
    if (std::abs(x) > 0.1f + w || std::abs(y) > 0.09f + w) return;
    lay(colour, palette.stripe, band(x, 0.056f, w) * band(y - 0.062f, 0.013f, w));
    const float slope = x - 0.042f + (0.062f - y) * 0.52f;
    lay(colour, palette.stripe, band(slope, 0.016f, w) * band(y + 0.004f, 0.076f, w));
  }
}

Vec3f shirt(const Vec3f& p, float w) {
  Vec3f colour = palette.shirt;
  // Stripes around the belly and over the shoulders; a plain field between them carries the emblem.
  const float field = below(1.195f - p.y, w) * below(p.y - 1.372f, w);
  if (field < 1.0f)
    lay(colour, palette.stripe, (1.0f - field) * stripes(p.y - 0.912f, 0.046f, 0.40f, w));
  emblem(colour, p, w);
  // A round neck, lower in front.
  const float neckline =
      p.y - 1.452f + 0.32f * (p.z + 0.02f) - 0.5f * std::max(std::abs(p.x) - 0.055f, 0.0f);
  lay(colour, palette.collar, below(-0.013f - neckline, w));
  lay(colour, palette.skin, below(-neckline, w));
  return colour;
}

Vec3f arm(const Vec3f& p, float w) {
  const Vec3f q(std::abs(p.x), p.y, p.z);
  const Vec3f upper = rest::elbow - rest::shoulder, lower = rest::wrist - rest::elbow;
  const float along = glm::dot(q - rest::shoulder, glm::normalize(upper));
  const float end = 0.62f * glm::length(upper);
  const float from_wrist = glm::dot(q - rest::wrist, glm::normalize(lower));
  Vec3f colour = palette.shirt;
  lay(colour, palette.stripe, stripes(along - 0.062f, 0.046f, 0.40f, w));
  lay(colour, palette.collar, band(along - end + 0.007f, 0.008f, w));
  lay(colour, palette.skin, below(end - along, w));
  // A wrist watch on the left, lines between the fingers, nails.
  if (p.x > 0.0f) {
    lay(colour, palette.belt, band(from_wrist + 0.020f, 0.010f, w));
    const Vec3f outer(0.766f, 0.643f, 0.0f);
    lay(colour, palette.buckle,
        band(from_wrist + 0.020f, 0.013f, w) * band(q.z, 0.013f, w) *
            below(0.0f - glm::dot(q - rest::wrist, outer), w));
  }
  if (from_wrist > 0.07f && q.z < 0.036f) {
    const float length = 0.178f - 4.0f * (q.z - 0.004f) * (q.z - 0.004f);
    for (const float z : {-0.018f, 0.0f, 0.018f}) {
      lay(colour, palette.crease,
          0.75f * band(q.z - z, 0.0011f, w) * below(0.082f - from_wrist, w) *
              below(from_wrist - length, w));
    }
  }
  return colour;
}

Vec3f trousers(const Vec3f& p, float w) {
  Vec3f colour = palette.trousers;
  const float ax = std::abs(p.x);
  // A stripe along the outer seam, pockets, a crease along the front and a darker turn-up.
  const float centre = 0.088f + 0.026f * (0.92f - p.y);
  if (ax > centre) {
    lay(colour, palette.seam, band(p.z + 0.002f, 0.012f, w) * below(p.y - 0.93f, w));
    lay(colour, palette.trousers, band(p.z + 0.002f, 0.003f, w));
  }
  if (p.z > 0.0f) {
    lay(colour, palette.shade, 0.5f * band(ax - centre, 0.0025f, w));
    lay(colour, palette.shade,
        band(p.y - 0.86f - 0.5f * (ax - 0.1f), 0.003f, w) * below(0.085f - ax, w));
  } else if (std::abs(p.y - 0.875f) < 0.041f + w) {
    lay(colour, palette.seam,
        0.8f * (band(ax - 0.07f, 0.038f, w) * band(p.y - 0.875f, 0.040f, w) -
                band(ax - 0.07f, 0.035f, w) * band(p.y - 0.875f, 0.037f, w)));
  }
  lay(colour, palette.shade, below(p.y - 0.135f, w));
  lay(colour, palette.belt, below(0.905f - p.y, w));
  return colour;
}

Vec3f shoe(const Vec3f& p, float w) {
  Vec3f colour = palette.shoe;
  const float ax = std::abs(p.x);
  lay(colour, palette.sole, below(p.z * -1.0f + 0.128f, w));
  lay(colour, palette.belt, band(p.y - 0.022f, 0.002f, w));
  lay(colour, palette.sole, below(p.y - 0.020f, w));
  lay(colour, palette.lace,
      below(0.040f - p.z, w) * below(p.z - 0.115f, w) * band(ax - 0.117f, 0.017f, w) *
          stripes(p.z, 0.016f, 0.45f, w) * below(0.045f - p.y, w));
  lay(colour, palette.belt, below(p.z + 0.078f, w) * band(p.y - 0.05f, 0.018f, w));
  // The sock.
  lay(colour, palette.sole, below(0.083f - p.y, w) * below(p.z - 0.03f, w));
  return colour;
}

}  // namespace

Vec3f figure_albedo(const Vec3f& p, float width) {
  const float w = std::max(width, 2e-4f);
  const float ax = std::abs(p.x);
  if (p.y > 1.44f && p.z < -0.104f) return ponytail(p, w);
  if (p.y > 1.522f) return head(p, w);
  // The seam of the sleeve: a plane across the shoulder that leans towards the arm.
  if (0.92f * (ax - 0.152f) + 0.25f * (p.y - 1.40f) > 0.0f && (ax > 0.19f || p.y > 1.31f))
    return arm(p, w);
  // The hem hangs a little lower behind.
  const float hem = p.y - 0.912f + 0.05f * p.z;
  if (p.y > 0.95f) {
    Vec3f colour = shirt(p, w);
    return colour;
  }
  if (p.y > 0.88f) {
    const float above = below(-hem, w);
    return shirt(p, w) * above + trousers(p, w) * (1.0f - above);
  }
  if (p.y > 0.11f) return trousers(p, w);
  const float cuff = below(0.097f - p.y, w);
  return trousers(p, w) * cuff + shoe(p, w) * (1.0f - cuff);
}

}  // namespace polyhull
