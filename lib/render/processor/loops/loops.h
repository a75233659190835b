// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The renderer's inner loops, compiled once per instruction set (loops.inc) and chosen at run
/// time. The results are the same to the bit: plain C++ without contraction, vectorised by the
/// compiler.
#pragma once

#include <cstdint>

#include "base/instruction_set.h"
#include "raster/raster_loops.h"

namespace polyhull::processor {

/// Of a depth map, each 0..1.
struct SkinTexel {
  float depth, fade;
};

/// What a camera's view of a subject is sampled with.
struct SkinView {
  float pixel_from_local[3][4];  ///< to (u z, v z, z), pinhole pixels
  // The depth map; no map: null. Rows of map_stride texels, with a column of zeros at the right, two
  // rows at the bottom and a texel after them.
  const SkinTexel* map = nullptr;
  float map_x = 0.0f, map_y = 0.0f, map_scale = 1.0f;  ///< texel = (pixel - map_x) * map_scale
  float map_near = 0.0f, map_range = 1.0f;
  int map_width = 0, map_height = 0, map_stride = 0;
  float tolerance = 0.0f;
  float rest = 0.0f;  ///< what the rim of what it sees still counts (subject/soft_edge.h)
  // The picture, RGBA bytes; the centre of texel (0, 0) is the real pixel (origin_x, origin_y).
  const std::uint32_t* pixels = nullptr;
  int width = 0, height = 0, stride = 0;
  float origin_x = 0.0f, origin_y = 0.0f;
  float scale = 1.0f;  ///< of a smaller picture: its pixels per real one
  bool distorted = false;
  float fx = 1.0f, fy = 1.0f, cx = 0.0f, cy = 0.0f, skew = 0.0f;
  float lens[12] = {};
};

/// A place of a triangle on the screen that is to be coloured.
struct SkinSpot {
  double x, y;
  std::uint32_t triangle;  ///< ScreenTriangles::piece()
  std::uint32_t pixel;
  float share;
};

/// A triangle's corner, as HullVertex (subject/hull_vertices.h).
struct SkinCorner {
  float position[3];
  std::uint16_t weights[4];
  std::uint8_t slots[4];
  std::uint16_t fill[4];
};

/// Points of a subject, in arrays of \p count, a multiple of 8.
struct SkinPoints {
  int count = 0;
  const float* x = nullptr;  ///< local coordinates
  const float* y = nullptr;
  const float* z = nullptr;
  const float* depth = nullptr;  ///< before the viewport
};

/// The pictures that one view's colours are taken from, each half the size of the one before
/// (subject/view_picture.h).
struct SkinPictures {
  const SkinView* views = nullptr;  ///< of one camera, from its own picture on
  int count = 1;
  float factor = 1.0f;  ///< pixels that a pixel of the viewport spans where the depths agree
  const float* colour =
      nullptr;  ///< to the colours that are wanted, column by column; null: they are
};

/// The points' linear colours; \p alpha null: not wanted.
struct SkinColours {
  float *red, *green, *blue, *alpha;
};

/// Where a view shows what another one shows (PictureFlow), in that view's pinhole pixels.
struct SkinFlow {
  const std::int8_t* offsets = nullptr;    ///< x, y of each texel
  int width = 0, height = 0;               ///< at least 2
  float x = 0.0f, y = 0.0f, scale = 1.0f;  ///< texel = (pixel - x) * scale
  float unit = 1.0f;                       ///< pixels of an offset of 1
  std::uint32_t other = 0;                 ///< the other view's slot
  float towards = 0.5f;                    ///< how much nearer to the other the eye is, 0..1
};

/// A block of the shadow's grid and what lies up to `reach` pixels around it, row by row.
struct ShadowTile {
  static constexpr int side = 16, reach = 2, stride = side + 2 * reach, size = stride * stride;
  static constexpr int channels = 3;
  float inverse[size];         ///< 1/z; 0: outside
  float mean[channels][size];  ///< what the pixel's own rays say
  float normal_x[size], normal_y[size], normal_z[size];
  float any_normal[size];            ///< 1: what the pixel takes is 0 whatever its normal; else 0
  float ray[3], ray_x[3], ray_y[3];  ///< of the block's first pixel, and to the next ones
};

/// What the shadow's grid says of eight pixels of it in two rows, and of the one after them.
struct ShadowRows {
  const float *inverse[2], *taken[2];
};

/// What a coarser grid says, by channel, of its pixels around 16 of the picture's row: up to `most` of each.
struct SoftRows {
  static constexpr int most = 9;
  int step = 4;        ///< pixels of the picture from one of the grid to the next, 2 or 4
  float below = 0.0f;  ///< how far below the upper row these are, of the way to the lower one
  const float *inverse[2], *taken[2][3];
};

/// An image of bits, with a column and a row of zeros all around (light_masks.h): word
/// x / 32 * height + y has the bits of columns x / 32 * 32 and on of row y, from the lowest on.
struct MaskImage {
  const std::uint32_t* bits = nullptr;
  int width = 0, height = 0;
  float scale[2], origin[2], per_w[2];  ///< texel = m * scale + origin + w * per_w
};

/// Points in a light's map, in arrays of \p count.
struct MaskPoints {
  int count = 0;
  const float* x = nullptr;  ///< the tangents m
  const float* y = nullptr;
  const float* w = nullptr;  ///< 1/z
};

/// Places on a lamp that shines to one side.
struct LampPlaces {
  static constexpr int most = 16;
  float x[most] = {}, y[most] = {}, z[most] = {};
  float facing[3];  ///< unit length
};

/// From linear light to the nearest byte of sRGB, by a straight line in each sixteenth of an octave:
/// byte = bias + slope * light, cut off.
struct SrgbLines {
  static constexpr int octaves = 13, steps = 16 * octaves;
  float bias[steps], slope[steps];
};

/// Eight pixels of a row that are put together; linear light but for the bytes.
struct BlendPixels {
  static constexpr int count = 8;
  /// Less than a sixth of the smallest step of the darkest values is no change.
  static constexpr float least_missing = 4e-5f;
  bool layered = true;              ///< else only background, albedo and taken have an effect
  std::uint32_t background[count];  ///< RGBA bytes, a little-endian word
  std::uint64_t albedo[count];      ///< 16 bits a channel
  float taken[3][count];            ///< the lights' that is missing
  float dimmed[3][count];           ///< what is missing in the mirror, as a picture value
  float keep[count];                ///< of what is there before `more` comes to it
  float covered[count];             ///< by the mirror's image
  float gone[3][count];             ///< what the mirror showed; at most the covered part goes
  float more[3][count];             ///< by the mirror's image
  float red[count], green[count], blue[count], alpha[count];  ///< the subject over all that
};

struct Loops {
  /// Makes a record of 16 numbers (SkinItem) of each spot: what the three \p corners of its triangle
  /// have, in the shares in which they make it up, and its depth times \p scale.
  void (*place)(const SkinSpot* spots, int count, const ScreenTriangle* triangles,
                const SkinCorner* const* corners, float scale, float* records);
  /// Brings four numbers of each record, of 16 each, into the arrays \p to: those of record which[i] to
  /// place i. \p count is a multiple of 4.
  void (*spread)(const float* records, const std::uint32_t* which, int count,
                 float* const (&to)[4]);
  /// weight[i] becomes the share of it with which \p view sees point i, and \p least of it; u, v the
  /// pinhole pixels.
  void (*look)(const SkinView& view, const SkinPoints& points, float least, float* u, float* v,
               float* weight);
  /// Keeps the \p best largest of \p views weights of each point (of 64 at most, none negative), less the
  /// weight l of the first one that is left out: w becomes max(0, w - l). What enters and leaves the
  /// chosen few does so at weight zero, and the blend stays continuous (Buehler et al. 2001). But for a
  /// thousandth of the largest: l is at most .999 of it, so that views that weigh alike do not leave
  /// nothing. The sum of what is kept becomes the share of the point that is sure: all of it where all
  /// weights together are \p range or more, below it fades to 0. Colours become the rest's.
  void (*settle)(float* const* weights, int views, int best, float range, int count,
                 const SkinColours& colours);
  /// Moves each place u, v of a view by \p share of what \p flow has there.
  void (*displace)(const SkinFlow& flow, int count, const float* share, float* u, float* v);
  /// Adds \p weight of what \p pictures have at the pinhole pixels u, v (which are overwritten), with
  /// \p decode of 256 values from their codes to linear light. To alphas, if they are wanted, their
  /// mattes' are added in whole, 0..1.
  void (*add)(const SkinPictures& pictures, const SkinPoints& points, const float* weight,
              const float* decode, float* u, float* v, const SkinColours& colours);
  /// The block's weighted means, side * side of each of the first \p channels (1 or 3), over the pixels
  /// around that lie in the plane of each.
  void (*gather)(const ShadowTile& tile, int channels, float* means);
  /// What 16 pixels of a picture's row take, from the grid's pixels around them (every second one
  /// of every second row) that lie as deep; \p inverse 1/z at theirs.
  void (*take)(const ShadowRows& rows, const float* inverse, float* taken);
  /// The same by channel from a coarser grid's four around each, the nearer ones more (bilinear).
  void (*take_soft)(const SoftRows& rows, const float* inverse, float (&taken)[3][16]);
  /// Sets in \p to and \p next the bits of the 8 * \p eights words \p from, moved up by \p bits, 0 to
  /// 31: those that leave a word of \p to come into that of \p next.
  void (*shift_onto)(const std::uint32_t* from, int eights, int bits, std::uint32_t* to,
                     std::uint32_t* next);
  /// Sets \p bit of the words \p found of those points that fall on a bit of \p image.
  void (*look_up)(const MaskImage& image, const MaskPoints& points, std::uint32_t bit,
                  std::uint32_t* found);
  /// What a surface at \p at of unit \p normal gets from those of the places of which \p which has a
  /// bit, if nothing is in between: the sum of the cosines there and here over the distance's square.
  float (*given)(const LampPlaces& places, const float* at, const float* normal,
                 std::uint32_t which);
  /// Puts the pixels together into \p out, RGBA bytes; returns how many are not the background's any
  /// more. \p power of the lights: by how much a
  /// background of albedo 1 falls for taken = 1; \p decode as for add().
  int (*blend)(const BlendPixels& pixels, const float (&power)[3], const float* decode,
               const SrgbLines& encode, std::uint32_t* out);

  static const Loops& baseline();
  static const Loops& avx2();
  static const Loops& best() { return best_loops<Loops>(); }
};

/// Within a sixtieth of a step of the curve.
const SrgbLines& srgb_lines();

}  // namespace polyhull::processor
