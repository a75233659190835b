// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Key, blur, trace and approximate in one pass over the frame. The same stages, called one after
/// the other on whole planes (Keyer::key, Blur::apply, Contourer::find), give the same bytes.
#pragma once

#include <cstdint>
#include <memory>

#include "base/rings.h"
#include "silhouette/blur/blur.h"
#include "silhouette/contour/contourer.h"
#include "silhouette/key/key.h"

namespace polyhull {

/// The settings of all stages.
struct SilhouetteSettings {
  KeySettings key;
  BlurSettings blur;
  TraceMethod method = TraceMethod::subpixel;
  bool correct_curvature = true;  ///< undo the shift that the blur puts on curved boundaries
  ApproximateSettings approximate;
  double steadiness = ContourSettings{}.steadiness;
  bool keep_matte = true;  ///< write_rgba() will be called
  /// A frame equal to its predecessor inside the region of interest keeps its contours.
  bool reuse = true;
  bool operator==(const SilhouetteSettings&) const = default;
};

/// The sigma to correct for (TraceSettings::corrected_sigma) after a blur, 0 when it is not to be
/// corrected: no blur, or a threshold made the matte binary again.
double corrected_sigma(const BlurSettings& blur, bool correct_curvature);

/// The smallest rectangle of whole pixels that holds the rings, clipped to the frame.
Rectangle bounding_rectangle(const Rings& rings, int width, int height);

/// Since the silhouetter was made.
struct SilhouetteStats {
  std::uint64_t frames = 0;
  std::uint64_t reused = 0;  ///< frames that kept their predecessor's contours
  std::uint64_t steady = 0;  ///< frames whose contours stayed (ContourSettings::steadiness)
  std::uint64_t empty = 0;   ///< frames without foreground
  ApproximateCounts last;    ///< of the last frame that was traced
};

/// One stream's silhouettes.
class Silhouetter {
 public:
  Silhouetter();
  ~Silhouetter();
  Silhouetter(Silhouetter&&) noexcept;
  Silhouetter& operator=(Silhouetter&&) noexcept;

  /// Throws Error (bad_input) for values out of range.
  void set(const SilhouetteSettings& settings);
  const SilhouetteSettings& settings() const;

  /// To change the keyer beside its settings; the next frame is then processed in any case.
  Keyer& keyer();
  const Keyer& keyer() const;

  /// The frame's silhouette. The reference stays valid until the next call. Throws Error as
  /// Keyer::prepare() does.
  const Rings& process(const FrameView& frame);

  /// The pixels of a region (e.g. bounding_rectangle()) of the frame just processed, despilled,
  /// with the matte as it was keyed as alpha, as soft as the picture's edges: byte for byte what the
  /// chain of elements has there. Needs SilhouetteSettings::keep_matte.
  void write_rgba(const FrameView& frame, const Rectangle& region, std::uint8_t* rgba,
                  std::ptrdiff_t stride) const;

  const SilhouetteStats& stats() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
