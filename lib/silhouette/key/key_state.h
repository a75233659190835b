// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a Keyer holds between frames. Internal.
#pragma once

#include <array>
#include <vector>

#include "silhouette/key/closed_gaps.h"
#include "silhouette/key/edge_map.h"
#include "silhouette/key/key_signal.h"

namespace polyhull {
namespace silhouette {

/// What is nearly background or nearly foreground, made plain away from edges. Kernels silence only
/// whole blocks (see Ramp); a face that is nearly solid would show their outlines.
struct Quiet {
  bool active = false;                    ///< else whole blocks do: their steps are not seen
  std::uint8_t dark = 0;                  ///< alpha up to this is nearly background
  std::uint8_t bright = 255;              ///< alpha from this on is nearly foreground
  std::array<std::uint8_t, 256> value{};  ///< alpha far from edges; continuous in alpha
};

/// \p low and \p high: what is silenced in whole blocks, see Ramp.
Quiet quiet_for(std::uint8_t low, std::uint8_t high);

/// Silences the mixed blocks of columns [begin, end) of a row, except beside edges; \p begin is the
/// first column of a block. Reads and writes \p states.
void quieten_row(const Quiet& quiet, int begin, int end, std::uint8_t* alpha, BlockState* states);

}  // namespace silhouette

struct Keyer::State {
  enum class Path : std::uint8_t {
    pixels,     // four-byte pixels as they come
    chroma,     // 8-bit Y'CbCr, chroma alone
    converted,  // row by row through RGBA
  };

  KeySettings settings;
  // settings.method, or difference for a key colour without hue.
  KeyMethod method = KeyMethod::soft;

  // Samples: kept until the settings they depend on, the frame's size or format change.
  KeyCalibration samples;
  double noise = 0.0;          // of the screen's signal, levels
  double unevenness = 0.0;     // of the screen's signal over the picture
  double spread_inside = 0.0;  // by which the subject's least solid parts stay below alpha 1
  double screen_level = 0.0, foreground_level = 0.0;  // of the calibrated signal
  KeyColour key = KeyColour::green;                   // custom where the signal is turned to `hue`
  Rgb hue{0, 255, 0};                                 // of the custom or found key colour
  bool fresh_settings = true;                         // tables must be laid out again
  bool found = false;                                 // the picture has been sampled

  // Where the screen was sampled in the dark, how it was lit, to see when the light comes.
  struct Light {
    int screen = 0;    // of a few points: those with at least half of the screen's signal,
    int brighter = 0;  // and with clearly more than it
  };
  bool dark = false;
  int bright_frames = 0;  // in a row, since
  silhouette::KeySignal sampled_signal;
  Light light;

  // The frame the tables are for.
  FrameFormat format = FrameFormat::rgba;
  int width = 0, height = 0;
  ColourMatrix matrix = ColourMatrix::bt601;
  bool full_range = false;
  ChromaSite site = ChromaSite::left;
  BayerOrder bayer = BayerOrder::bggr;
  SampleLayout layout{};

  Path path = Path::pixels;
  Rectangle active;
  silhouette::KeySignal signal;
  silhouette::PixelForms forms{};
  silhouette::ChromaForms chroma{};
  silhouette::Ramp ramp{};
  silhouette::Quiet quiet;
  silhouette::DifferenceRamp difference{};
  bool local = false;                    // base and gain differ from pixel to pixel
  std::vector<std::int16_t> base, gain;  // rows of whole blocks
  std::vector<std::uint8_t> plate;       // R, G, B, tolerance; rows of whole blocks
  std::vector<std::uint8_t> allowed;     // 255 where foreground may be; empty: everywhere
  std::vector<std::uint8_t> forced;      // 255 where foreground is forced; empty: nowhere

  // Learning the plate.
  int learning = 0, learned = 0;
  std::vector<float> sums;                  // R, G, B and their squares
  std::vector<std::uint8_t> learned_plate;  // R, G, B, tolerance per pixel

  Matte scratch;                // morphology
  silhouette::ClosedGaps gaps;  // of the last frame that key() did
  silhouette::EdgeMap edges;    // of the last frame, where despills()

  std::size_t row_length() const {
    return static_cast<std::size_t>(blocks_across(width)) * matte_block;
  }
  void lay_out(const FrameView& frame);
  void sample(const FrameView& frame);
  Light light_of(const FrameView& frame) const;
  // Whether most of a screen that was sampled in the dark is clearly brighter now, and has been for some
  // frames. Asked once for each.
  bool light_came(const FrameView& frame);
  void lay_out_screen(const FrameView& frame);
  void lay_out_plate();
  void lay_out_masks();
  void learn(const FrameView& frame);
  KeyLack lack() const;
  bool despills() const { return settings.spill > 0.0 && method != KeyMethod::difference; }
  void pixel_alpha_row(const FrameView& frame, int y, int x0, int end, std::uint8_t* alpha,
                       BlockState* states) const;
  void alpha_row(const FrameView& frame, int y, std::uint8_t* alpha, BlockState* states) const;
  void limited_row(const FrameView& frame, int y, std::uint8_t* alpha, BlockState* states) const;
};

namespace silhouette {

/// Grows (radius > 0) or shaves (radius < 0) a matte by that many px, its soft edge kept;
/// octagonal.
void grow(Matte& matte, double radius, Matte& scratch);

/// The q-quantile of at least one number; changes their order.
double quantile(std::vector<double>& v, double q);

/// Clears what of a row lies outside columns [x0, x1), or where \p allowed (null: everywhere) is 0.
void limit_row(std::uint8_t* row, int width, int x0, int x1, const std::uint8_t* allowed);

/// Fills rows of whole blocks with 255 where the pixel centre is inside the rings (even-odd).
void fill_polygon(const Rings& rings, int width, int height, std::vector<std::uint8_t>& plane);

}  // namespace silhouette
}  // namespace polyhull
