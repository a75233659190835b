// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Reading the views that an element under test sends.
#pragma once

#include <gst/gst.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "element_test.h"
#include "mesh/view.h"
#include "wire/view_payload.h"

namespace polyhull::test {

inline std::vector<std::uint8_t> bytes_of(GstBuffer* buffer) {
  std::vector<std::uint8_t> bytes(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
  return bytes;
}

/// A view with the bytes that it borrows from.
struct ReadView {
  std::vector<std::uint8_t> bytes;
  View view;
};

/// Reads \p buffer and drops the reference.
inline ReadView take_view(GstBuffer* buffer) {
  fail_unless(buffer != nullptr, "no view came");
  ReadView result{bytes_of(buffer), {}};
  result.view = read_view(Bytes(result.bytes));
  gst_buffer_unref(buffer);
  return result;
}

/// Twice the signed area, positive for rings that run counter-clockwise on screen (y down).
inline double signed_area(std::span<const Vec2f> ring) {
  double sum = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vec2f& a = ring[i];
    const Vec2f& b = ring[(i + 1) % ring.size()];
    sum += static_cast<double>(b.x) * a.y - static_cast<double>(a.x) * b.y;
  }
  return 0.5 * sum;
}

/// Area of all rings, holes subtracted.
inline double area_of(const Rings& rings) {
  double sum = 0.0;
  for (std::size_t i = 0; i < rings.size(); ++i) sum += signed_area(rings.ring(i));
  return sum;
}

}  // namespace polyhull::test
