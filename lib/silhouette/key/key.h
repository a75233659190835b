// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Keying: which pixels show the subject, as 8-bit alpha.
///
/// The key signal of a pixel is d = min(a·rgb, b·rgb) with two weight vectors that each sum to 0,
/// so grey has d = 0 at any brightness and d grows with saturation towards the key colour. For
/// green a = G − R and b = G − B, hence d = G − max(R, B), the prototype's signal; for another hue
/// the pair is rotated about the grey axis. d needs no luma, so for Y'CbCr formats it is formed
/// from chroma alone.
///
///  - KeyMethod::threshold (thesis 3.4.1): background where d > strength, unless
///    R+G+B > bright_threshold.
///  - KeyMethod::soft: alpha = (d_s − d) / (d_s − d_f), d_s the signal of the screen and d_f that
///    of the foreground: linear in the mixing fraction of a pixel that shows both, so the half
///    level lies on the true edge. Both are sampled from the picture unless given, and again where
///    a dark screen (no channel above 127 levels) was sampled and most of it has a signal of 5/4 d_s
///    or more in five frames one after the other. With a clean plate d_s is the plate's value at that
///    pixel; else both are followed over the picture, tile by tile (colours/local_colours.h), and where edges mix
///    light rather than levels alpha is that of light (colours/mixing.h).
///  - KeyMethod::difference: no screen at all: alpha grows with the colour distance between the
///    pixel and the clean plate (or, without one, the key colour), where the plate may be darkened
///    to `shadow_darkest` or brightened to `light_brightest` of itself first: a shadow scales all
///    channels alike.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/picture.h"
#include "base/rings.h"
#include "base/vector.h"
#include "silhouette/pixels/frame.h"
#include "silhouette/pixels/matte.h"

namespace polyhull {

enum class KeyMethod : std::uint8_t { threshold, soft, difference };
enum class KeyColour : std::uint8_t { green, blue, custom, automatic };

/// What write_rgba() shows.
enum class KeyView : std::uint8_t {
  composite,  ///< the despilled picture with the matte as alpha
  matte,      ///< the matte as opaque grey
  status,     ///< background black, foreground white, in between coloured by alpha
  spill,      ///< what despill takes away, opaque
  split,  ///< four opaque pictures of half the size: the frame, matte; status, composite on grey
};

/// Red, green and blue as in the picture, 0..255.
using Rgb = std::array<std::uint8_t, 3>;

/// How the matte is made.
struct KeySettings {
  KeyMethod method = KeyMethod::soft;
  KeyColour key = KeyColour::green;
  Rgb colour{0, 255, 0};  ///< with KeyColour::custom

  int strength = 30;           ///< prototype: margin of the key channel, 0..255
  int bright_threshold = 700;  ///< prototype: R+G+B above this is foreground, 0..765

  double red_gain = 1.0;   ///< multiplies red for the decision only, 0..4
  double blue_gain = 1.0;  ///< multiplies blue for the decision only, 0..4

  Rectangle roi;  ///< outside is background; empty: the whole frame

  std::optional<Rgb> screen;      ///< soft: sample of the screen; unset: sampled from the picture
  std::optional<Rgb> foreground;  ///< soft: sample of the subject near its edge; unset: sampled

  /// Alpha below this fraction is 0, 0..1; the rest is stretched. Noise (measured on the screen) is
  /// silenced besides, where nothing else is.
  double clip_black = 0.02;
  double clip_white = 0.98;  ///< alpha above this fraction is 255, clip_black..1

  double choke = 0.0;  ///< px by which the matte is shaved off (negative: grown), -32..32
  /// Px: gaps and holes up to twice this width are closed (grown, then choked), 0..32. Difference:
  /// what shows a coloured plate there takes the colours around.
  double close = 0.0;

  /// Fraction of the key colour's spill that is removed, 0..1: all of it at the matte's edges and
  /// outside, where the matte is solid only as much as the screen's light on a subject can be.
  double spill = 1.0;

  std::shared_ptr<const Picture> plate;  ///< clean plate (RGB or RGBA), the frame's size
  /// Difference: distance in levels up to which a pixel is background.
  double difference_low = 12.0;
  double difference_high = 36.0;  ///< difference: distance in levels from which it is foreground
  /// Difference: a shadow keeps at least this fraction of the light, 0..1.
  double shadow_darkest = 0.5;
  /// Difference: light may rise to this multiple of the plate's, 1..4.
  double light_brightest = 1.2;
  /// Difference: how much of a change of light counts as distance, 0..1.
  double light_penalty = 0.15;

  std::shared_ptr<const Picture> outside_mask;  ///< grey; where it is not 0 the matte is background
  std::shared_ptr<const Picture> inside_mask;   ///< grey; where it is not 0 the matte is foreground
  Rings outside_polygon;  ///< outside these rings (even-odd) is background; empty: no restriction
  Rings inside_polygon;   ///< inside these rings is foreground
  bool operator==(const KeySettings&) const = default;
};

/// What the method needs and the last frame was keyed without.
enum class KeyLack : std::uint8_t {
  nothing,
  screen,  ///< soft, automatic: no screen was found yet, so everything is foreground
  plate,   ///< difference: no clean plate, so the distance is that to a pure green or blue
};

/// What the keyer measured or was told; for properties, stats and reports.
struct KeyCalibration {
  bool valid = false;  ///< samples found (or given)
  KeyLack lacks = KeyLack::nothing;
  Rgb screen{};                    ///< colour of the screen
  Rgb foreground{};                ///< colour of the foreground
  double screen_signal = 0.0;      ///< d_s in levels
  double foreground_signal = 0.0;  ///< d_f in levels
  int plate_frames_left = 0;       ///< frames still to be averaged into the clean plate
};

/// Keys the frames of one stream. Use from one thread at a time.
class Keyer {
 public:
  Keyer();
  ~Keyer();
  Keyer(Keyer&&) noexcept;
  Keyer& operator=(Keyer&&) noexcept;

  /// Takes new settings; samples taken from the picture are kept unless what they depend on
  /// changed. Throws Error (bad_input) for values out of range.
  void set(const KeySettings& settings);
  const KeySettings& settings() const;

  /// Averages the next \p frames frames (100,000 at most; 0: stops learning) into the clean plate
  /// (with their variation, so that flickering lamps are tolerated); meanwhile every frame is keyed
  /// with what was there before.
  void learn_plate(int frames);

  /// Samples the picture again at the next frame.
  void recalibrate();

  /// Once per frame, before key_row(): samples the picture if needed, learns the plate, lays out
  /// the per-row tables. Throws Error when the plate's or a mask's size is not the frame's, and as
  /// check_frame().
  void prepare(const FrameView& frame);

  /// The frame's part that can be foreground: region of interest and garbage mattes clipped to the
  /// frame.
  Rectangle active() const;

  /// True when the matte of a row depends on its neighbours (choke, close): only key() will do.
  bool needs_plane() const;

  /// Alpha and block states of the whole row \p y (frame.width values); rows come from top to
  /// bottom, each once. Values are rounded up to whole blocks: \p alpha must have room for
  /// blocks_across(width) * matte_block. Without \p for_colours write_rgba() cannot follow.
  void key_row(const FrameView& frame, int y, std::uint8_t* alpha, BlockState* states,
               bool for_colours = true);

  /// Columns [x0, x1) of what key_row() gave for row \p y of this frame, with for_colours.
  void keyed_row(int y, int x0, int x1, std::uint8_t* alpha) const;

  /// prepare() and all rows, then close and choke. Throws Error as prepare().
  void key(const FrameView& frame, Matte& matte);

  /// So many rows below a region must be keyed before it is written; holds from prepare() on.
  int rows_below() const;

  /// Writes the region's pixels as RGBA, \p rgba pointing at its top-left pixel. Colours depend on
  /// the frame as it was keyed, not on \p matte, so that one blurred later finds despilled pixels
  /// beside the subject too. KeyView::split: the region is the whole frame.
  void write_rgba(const FrameView& frame, const Matte& matte, const Rectangle& region, KeyView view,
                  std::uint8_t* rgba, std::ptrdiff_t stride) const;

  KeyCalibration calibration() const;

 private:
  void write_split(const FrameView& frame, const Matte& matte, std::uint8_t* rgba,
                   std::ptrdiff_t stride) const;

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
