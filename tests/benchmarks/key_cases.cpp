// SPDX-License-Identifier: LGPL-2.1-or-later
/// Errors of matte, straight colour and contour on pictures whose truth is known: a lemur's hair and
/// disks before screens of several kinds. Usage: key_cases FOLDER [DATA]; writes key_cases.csv and,
/// with a third argument, the mattes and pictures over grey.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>

#include "base/picture.h"
#include "benchmarks/measure.h"
#include "lib/silhouette/silhouette_frames.h"
#include "silhouette/contour/contourer.h"
#include "silhouette/key/key.h"

using namespace polyhull;
using namespace polyhull::benchmark;
using test::Colour;

namespace {

double decode(double level) {
  const double v = level / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

double encode(double light) {
  const double v = std::clamp(light, 0.0, 1.0);
  return 255.0 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055);
}

/// What a camera would see of a subject before a screen.
struct Scene {
  int width = 0, height = 0;
  std::vector<double> alpha;
  std::vector<Colour> foreground;
  double at(int x, int y) const { return alpha[static_cast<std::size_t>(y) * width + x]; }
};

struct Case {
  std::string name;
  const Scene* scene;
  FrameFormat format = FrameFormat::rgbx;
  double noise = 0.0;     // standard deviation in levels
  double uneven = 0.0;    // the screen's light falls and rises by this share
  double spill = 0.0;     // of the screen's colour that lies on the subject
  bool in_light = false;  // edges mix light, not levels
  Colour screen{60, 170, 75};
  bool empty_first = false;  // a frame of the empty stage comes first
  bool dark_first = false;   // one in the dark
  KeyColour key = KeyColour::green;
};

Colour screen_at(const Case& c, int x, int y) {
  const double u = 2.0 * x / c.scene->width - 1.0, v = 2.0 * y / c.scene->height - 1.0;
  const double light = 1.0 + c.uneven * (0.7 * u + 0.3 * v * v - 0.15);
  return {c.screen[0] * light, c.screen[1] * light, c.screen[2] * light};
}

Colour mixed(const Colour& over, const Colour& under, double alpha, bool in_light) {
  Colour out;
  for (int i = 0; i < 3; ++i)
    out[i] = in_light ? encode(alpha * decode(over[i]) + (1.0 - alpha) * decode(under[i]))
                      : alpha * over[i] + (1.0 - alpha) * under[i];
  return out;
}

test::Frame frame_of(const Case& c, bool empty, double light) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  return test::make_frame(c.format, c.scene->width, c.scene->height, [&](int x, int y) {
    const Colour screen = screen_at(c, x, y);
    Colour subject = c.scene->foreground[static_cast<std::size_t>(y) * c.scene->width + x];
    for (int i = 0; i < 3; ++i) subject[i] = std::min(subject[i] + c.spill * c.screen[i], 255.0);
    Colour out = mixed(subject, screen, empty ? 0.0 : c.scene->at(x, y), c.in_light);
    for (double& v : out) v = std::clamp(v * light + c.noise * noise(random), 0.0, 255.0);
    return out;
  });
}

/// Twice the area inside and the length of the half level's contours.
struct Outline {
  double area = 0.0, length = 0.0;
};

Outline outline_of(const Matte& matte) {
  ContourSettings settings;
  settings.approximate.tolerance = 0.0;
  Contourer contourer;
  const Rings& rings = contourer.find(matte, settings);
  Outline out;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const auto ring = rings.ring(i);
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2 a(ring[k]), b(ring[(k + 1) % ring.size()]);
      out.area += a.x * b.y - a.y * b.x;
      out.length += glm::length(b - a);
    }
  }
  return out;
}

Matte matte_of(const Scene& scene) {
  Matte matte;
  matte.resize(scene.width, scene.height);
  for (int y = 0; y < scene.height; ++y) {
    for (int x = 0; x < scene.width; ++x)
      matte.row(y)[x] = static_cast<std::uint8_t>(std::lround(255.0 * scene.at(x, y)));
    find_states(matte.row(y), scene.width, matte.state_row(y));
  }
  return matte;
}

struct Result {
  double alpha_error = 0.0;
  double grey = 0.0, bright = 0.0;  // PSNR in the band around the edges, dB
  double bias = 0.0;                // px, outwards
};

Result measure(const Case& c, const std::string& pictures) {
  const Scene& scene = *c.scene;
  Keyer keyer;
  KeySettings settings;
  settings.key = c.key;
  keyer.set(settings);
  Matte matte;
  if (c.empty_first) keyer.key(frame_of(c, true, 1.0).view, matte);
  if (c.dark_first)
    for (int i = 0; i < 6; ++i) keyer.key(frame_of(c, false, i == 0 ? 0.25 : 1.0).view, matte);
  const test::Frame frame = frame_of(c, false, 1.0);
  keyer.key(frame.view, matte);
  std::vector<std::uint8_t> rgba(4 * scene.alpha.size());
  keyer.write_rgba(frame.view, matte, {0, 0, scene.width, scene.height}, KeyView::composite,
                   rgba.data(), 4 * scene.width);
  Result out;
  double squares[2] = {}, count = 0.0;
  const Colour backgrounds[2] = {{128, 128, 128}, {235, 235, 225}};
  for (int y = 0; y < scene.height; ++y)
    for (int x = 0; x < scene.width; ++x) {
      const double found = matte.row(y)[x] / 255.0, truth = scene.at(x, y);
      out.alpha_error += std::abs(found - truth);
      bool band = false;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const double near = scene.at(std::clamp(x + dx, 0, scene.width - 1),
                                       std::clamp(y + dy, 0, scene.height - 1));
          band |= near > 0.01 && near < 0.99;
        }
      if (!band) continue;
      count += 3.0;
      const std::size_t at = static_cast<std::size_t>(y) * scene.width + x;
      const Colour straight{double(rgba[4 * at]), double(rgba[4 * at + 1]),
                            double(rgba[4 * at + 2])};
      for (int b = 0; b < 2; ++b) {
        const Colour is = mixed(straight, backgrounds[b], found, c.in_light);
        const Colour should = mixed(scene.foreground[at], backgrounds[b], truth, c.in_light);
        for (int i = 0; i < 3; ++i) squares[b] += (is[i] - should[i]) * (is[i] - should[i]);
      }
    }
  out.alpha_error /= static_cast<double>(scene.alpha.size());
  out.grey = 10.0 * std::log10(255.0 * 255.0 * count / squares[0]);
  out.bright = 10.0 * std::log10(255.0 * 255.0 * count / squares[1]);
  const Outline is = outline_of(matte), should = outline_of(matte_of(scene));
  out.bias = (std::abs(is.area) - std::abs(should.area)) / 2.0 / should.length;
  if (!pictures.empty()) {
    Picture over{scene.width, scene.height, 3, {}}, alpha{scene.width, scene.height, 1, {}};
    for (std::size_t i = 0; i < scene.alpha.size(); ++i) {
      const int a = matte.row(static_cast<int>(i) / scene.width)[static_cast<int>(i) % scene.width];
      alpha.pixels.push_back(static_cast<std::uint8_t>(a));
      for (int k = 0; k < 3; ++k)
        over.pixels.push_back(
            static_cast<std::uint8_t>((rgba[4 * i + k] * a + 128 * (255 - a) + 127) / 255));
    }
    std::string name = c.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    save_picture(over, pictures + "/" + name + ".png");
    save_picture(alpha, pictures + "/" + name + "_matte.png");
  }
  return out;
}

/// Disks of these colours side by side, their edges smoothed by \p sigma px.
Scene disks(const std::vector<Colour>& colours, double sigma, int size = 256) {
  Scene scene;
  scene.width = size * static_cast<int>(colours.size());
  scene.height = size;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < scene.width; ++x) {
      const std::size_t which = static_cast<std::size_t>(x) / static_cast<std::size_t>(size);
      const double d =
          0.32 * size - std::hypot(x % size - (size - 1) / 2.0 - 0.2, y - (size - 1) / 2.0 - 0.3);
      scene.alpha.push_back(0.5 * std::erfc(-d / (sigma * std::numbers::sqrt2)));
      scene.foreground.push_back(colours[which]);
    }
  return scene;
}

Scene lemur(const std::string& folder, const Colour& tint) {
  const Picture colours = load_picture(folder + "/lemur_foreground.png", 3);
  const Picture alpha = load_picture(folder + "/lemur_alpha.png", 1);
  Scene scene;
  scene.width = colours.width, scene.height = colours.height;
  for (std::size_t i = 0; i < alpha.pixels.size(); ++i) {
    scene.alpha.push_back(alpha.pixels[i] / 255.0);
    scene.foreground.push_back({colours.pixels[3 * i] * tint[0],
                                colours.pixels[3 * i + 1] * tint[1],
                                colours.pixels[3 * i + 2] * tint[2]});
  }
  return scene;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  const char* environment = std::getenv("POLYHULL_DATA");
  const std::string data = argc > 2 ? argv[2] : environment != nullptr ? environment : ".";
  const std::string pictures = argc > 3 ? argv[3] : "";
  const Colour white{235, 235, 235}, black{22, 22, 22}, red{170, 35, 40}, brown{120, 85, 60},
      skin{205, 150, 125}, blue{50, 70, 160}, yellow{215, 190, 60}, cyan{90, 175, 190};
  const Scene scenes[] = {disks({white}, 1.0),        disks({black}, 1.0),
                          disks({red, brown}, 1.0),   disks({skin, black}, 1.0),
                          disks({blue, yellow}, 1.0), disks({white, cyan}, 1.0),
                          disks({white}, 4.0, 128),   disks({black}, 4.0, 128)};
  const char* names[] = {"white",       "black",      "red brown",  "skin black",
                         "blue yellow", "white cyan", "soft white", "soft black"};
  Scene hair, blond;
  std::vector<Case> cases;
  if (std::filesystem::exists(data + "/lemur/lemur_foreground.png")) {
    hair = lemur(data + "/lemur", {1, 1, 1});
    blond = lemur(data + "/lemur", {1.1, 0.95, 0.6});
    cases.push_back({"lemur n2", &hair, FrameFormat::rgbx, 2});
    cases.push_back({"lemur n4", &hair, FrameFormat::rgbx, 4});
    cases.push_back({"lemur 420 n2", &hair, FrameFormat::i420, 2});
    cases.push_back({"lemur v210 n2", &hair, FrameFormat::v210, 2});
    cases.push_back({"lemur uneven 420 n4", &hair, FrameFormat::i420, 4, 0.15});
    cases.push_back(
        {"lemur blue screen n2", &hair, FrameFormat::rgbx, 2, 0, 0, false, {50, 80, 180}});
    cases.back().key = KeyColour::blue;
    cases.push_back({"lemur spill n2", &hair, FrameFormat::rgbx, 2, 0, 0.12});
    cases.push_back({"blond spill n2", &blond, FrameFormat::rgbx, 2, 0, 0.12});
    cases.push_back({"lemur spill uneven 420 n4", &hair, FrameFormat::i420, 4, 0.15, 0.12});
    cases.push_back({"lemur light n2", &hair, FrameFormat::rgbx, 2, 0, 0, true});
  } else {
    std::printf("left out: %s/lemur is not here\n", data.c_str());
  }
  for (int i = 0; i < 8; ++i) {
    const std::string name = names[i];
    cases.push_back({name, &scenes[i], FrameFormat::rgbx, 1});
    cases.push_back({name + " uneven 420 n2", &scenes[i], FrameFormat::i420, 2, 0.15});
    cases.push_back({name + " light", &scenes[i], FrameFormat::rgbx, 1, 0, 0, true});
    cases.push_back({name + " light 420 n2", &scenes[i], FrameFormat::i420, 2, 0.15, 0, true});
    Case empty{name + " empty first", &scenes[i], FrameFormat::rgbx, 1};
    empty.empty_first = true;
    cases.push_back(empty);
  }
  Case dark{"red brown dark first", &scenes[2], FrameFormat::rgbx, 1};
  dark.dark_first = true;
  cases.push_back(dark);
  Table table(folder + "/key_cases.csv",
              "case,mean absolute alpha error x 1000,PSNR of the band over grey,over "
              "bright,contour bias px");
  for (const Case& c : cases) {
    const Result r = measure(c, pictures);
    table.row("%s,%.2f,%.1f,%.1f,%+.3f", c.name.c_str(), 1000.0 * r.alpha_error, r.grey, r.bright,
              r.bias);
  }
  return 0;
}
