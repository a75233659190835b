// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/srgb.h"

#include <array>
#include <vector>

namespace polyhull {
namespace {

std::array<float, 256> make_decode_table() {
  std::array<float, 256> table;
  for (std::size_t i = 0; i < table.size(); ++i)
    table[i] = static_cast<float>(srgb_decoded(static_cast<double>(i) / 255.0));
  return table;
}

// Fine enough that a value lands on a neighbouring byte only within 1/40 of a step of the border.
constexpr std::size_t encode_steps = srgb_encode_steps;

std::vector<std::uint8_t> make_encode_table() {
  std::vector<std::uint8_t> table(encode_steps + 1);
  std::size_t value = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double linear = static_cast<double>(i) / encode_steps;
    while (value < 255 && linear >= srgb_decoded((static_cast<double>(value) + 0.5) / 255.0))
      ++value;
    table[i] = static_cast<std::uint8_t>(value);
  }
  return table;
}

}  // namespace

const float* srgb_to_linear_table() {
  static const std::array<float, 256> table = make_decode_table();
  return table.data();
}

float srgb_to_linear(std::uint8_t value) {
  return srgb_to_linear_table()[value];
}

const std::uint8_t* linear_to_srgb_table() {
  static const std::vector<std::uint8_t> table = make_encode_table();
  return table.data();
}

std::uint8_t linear_to_srgb(float linear) {
  return linear_to_srgb(linear, linear_to_srgb_table());
}

}  // namespace polyhull
