// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/silhouette/contour_properties.h"

#include <array>

namespace polyhull::element {

template <>
GType enum_type<TraceMethod>() {
  return register_enum<TraceMethod>(
      "PolyhullContourMethod",
      {{TraceMethod::subpixel,
        "The line on which the interpolated matte is half, with sub-pixel precision", "subpixel"},
       {TraceMethod::binary,
        "The edges of the pixels whose matte is at least half, as whole pixels", "binary"}});
}

template <>
GType enum_type<TriggerSource>() {
  return register_enum<TriggerSource>(
      "PolyhullTriggerSource",
      {{TriggerSource::meta,
        "The number a trigger attached to the frame; without one, views are matched by their time",
        "meta"},
       {TriggerSource::offset,
        "The number a trigger attached to the frame, else the buffer's offset: for sources that "
        "count trigger pulses there, not their own frames",
        "offset"},
       {TriggerSource::none, "None; views are matched by their time", "none"}});
}

std::span<const Property<ContourValues>> contour_properties() {
  using S = ContourValues;
  static constexpr std::array table{
      property<&S::camera>("camera",
                           "Name of the camera whose frames these are, as in the rig file. Empty "
                           "takes the name of this element."),
      property<&S::method>("method", "Which line is traced around the foreground."),
      property<&S::correct_curvature>(
          "correct-curvature",
          "Whether the shift that gaussblur puts on curved boundaries (sigma squared times the "
          "curvature, halved) is taken back. Without a blur in front, or with its threshold set, "
          "there is nothing to correct."),
      property<&S::tolerance>("tolerance",
                              "Largest distance in pixels, from 0 to 100, between the traced line "
                              "and the polygon that replaces it (Hausdorff distance, never "
                              "exceeded but by steadiness). 0 keeps every traced point.",
                              0.0, 100.0),
      property<&S::min_edges>("min-edges",
                              "Rings with fewer edges than this, from 3 to 1000, are dropped as "
                              "noise after the polygon has been approximated.",
                              3, 1000),
      property<&S::min_area>("min-area",
                             "Outer rings that enclose fewer square pixels than this, from 0 to "
                             "1e9, are dropped as noise, with all that lies inside them.",
                             0.0, 1e9),
      property<&S::min_hole_area>(
          "min-hole-area", "Holes of fewer square pixels than this, from 0 to 1e9, are filled.",
          0.0, 1e9),
      property<&S::keep_largest>(
          "keep-largest",
          "How many outer rings, the largest ones, are kept, from 0 to 1000000. 0 keeps all.", 0,
          1000000),
      property<&S::steadiness>(
          "steadiness",
          "Pixels, from 0 to 10. Where the traced line runs within this distance of that which the "
          "last contours were made of, they stay, so that noise does not make the outline of what "
          "stands still flicker; all else is made anew, without a lag. 0, or with tolerance=0: "
          "nothing stays.",
          0.0, 10.0),
      property<&S::adaptive>("adaptive",
                             "Whether the tolerance is coarsened, up to 16 times its value, while "
                             "the elements behind report by QoS events that they miss the target "
                             "rate, and refined again when they hold it."),
      property<&S::target_rate>("target-rate",
                                "Frames per second, from 0 to 1000, that adaptive holds. 0 takes "
                                "the frame rate of the stream.",
                                0.0, 1000.0),
      property<&S::reuse>(
          "reuse",
          "Whether a frame that equals its predecessor inside the region of interest takes over "
          "its contours. Turning it off changes only the time taken, never the result."),
      property<&S::trigger>("trigger-from", "Where the trigger number of a view comes from."),
  };
  return table;
}

}  // namespace polyhull::element
