// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/silhouette/blur_properties.h"

#include <array>

namespace polyhull::element {

template <>
GType enum_type<BlurMethod>() {
  return register_enum<BlurMethod>(
      "PolyhullBlurMethod",
      {{BlurMethod::fir, "Weighted sum in fixed point, exact to a fraction of a level", "fir"},
       {BlurMethod::box, "Box filters one after the other, as the prototype did", "box"},
       {BlurMethod::recursive, "Recursive filter, whose time does not depend on sigma",
        "recursive"}});
}

std::span<const Property<BlurSettings>> blur_properties() {
  using S = BlurSettings;
  static constexpr std::array table{
      property<&S::sigma>("sigma",
                          "Standard deviation of the Gaussian in pixels, from 0 to 100. 0 leaves "
                          "the matte as it is.",
                          0.0, 100.0),
      property<&S::method>("method",
                           "How the Gaussian is computed; all methods follow the same sigma and "
                           "differ in time and error."),
      property<&S::passes>("passes",
                           "Number of box filters that are run one after the other, from 1 to 10. "
                           "Used by method=box only; more passes come nearer to a Gaussian.",
                           1, 10),
      property<&S::threshold>(
          "threshold",
          "Grey level from 0 to 255: after the blur, pixels at or above it become 255 and the "
          "others 0. 0 keeps the grey levels, which contours with sub-pixel precision need.",
          0, 255),
  };
  return table;
}

}  // namespace polyhull::element
