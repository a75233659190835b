// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/number_filter.h"

#include <cmath>
#include <cstring>

namespace polyhull {
namespace {

constexpr double most_steps = 1 << 30;

template <class T>
T load(const std::uint8_t* bytes, std::size_t index) {
  T value;
  std::memcpy(&value, bytes + index * sizeof(T), sizeof(T));
  return value;
}

template <class T>
void store(std::uint8_t* bytes, std::size_t index, T value) {
  std::memcpy(bytes + index * sizeof(T), &value, sizeof(T));
}

template <class T>
constexpr int top_bit = 8 * sizeof(T) - 1;

template <class T, class Number>
void filter(std::size_t count, std::size_t components, Number number, std::uint8_t* out) {
  for (std::size_t i = 0; i < count; ++i) {
    const T before = i < components ? T{0} : number(i - components);
    const T less = static_cast<T>(number(i) - before);
    const T sign_last = static_cast<T>((less << 1) ^ (less >> top_bit<T> != 0 ? ~T{0} : T{0}));
    for (std::size_t b = 0; b < sizeof(T); ++b)
      out[b * count + i] = static_cast<std::uint8_t>(sign_last >> (8 * b));
  }
}

/// Whole numbers; what each becomes is the caller's.
template <class T, class Put>
void unfilter(std::size_t count, std::size_t components, const std::uint8_t* in, Put put,
              std::uint8_t* out) {
  for (std::size_t i = 0; i < count; ++i) {
    T sign_last = 0;
    for (std::size_t b = 0; b < sizeof(T); ++b)
      sign_last = static_cast<T>(sign_last | static_cast<T>(T{in[b * count + i]} << (8 * b)));
    const T less = static_cast<T>((sign_last >> 1) ^ ((sign_last & 1) != 0 ? ~T{0} : T{0}));
    const T before = i < components ? T{0} : load<T>(out, i - components);
    store<T>(out, i, static_cast<T>(before + less));
  }
  put();
}

template <class T>
void filter_list(const Region& region, const std::uint8_t* numbers, std::uint8_t* out) {
  filter<T>(
      region.size / sizeof(T), region.components,
      [&](std::size_t i) { return load<T>(numbers, i); }, out);
}

template <class T>
void unfilter_list(const Region& region, const std::uint8_t* filtered, std::uint8_t* out) {
  unfilter<T>(
      region.size / sizeof(T), region.components, filtered, [] {}, out);
}

}  // namespace

float on_grid(std::int32_t multiple, double step) {
  return static_cast<float>(multiple * step);
}

bool round_to_grid(std::uint8_t* floats, std::size_t count, double step) {
  for (std::size_t i = 0; i < count; ++i)
    if (!(std::abs(load<float>(floats, i)) < most_steps * step)) return false;
  for (std::size_t i = 0; i < count; ++i)
    store(floats, i,
          on_grid(static_cast<std::int32_t>(std::lround(load<float>(floats, i) / step)), step));
  return true;
}

void filter_numbers(const Region& region, const std::uint8_t* numbers, std::uint8_t* out) {
  if (region.kind == RegionKind::grid) {
    filter<std::uint32_t>(
        region.size / sizeof(float), region.components,
        [&](std::size_t i) {
          return static_cast<std::uint32_t>(std::lround(load<float>(numbers, i) / region.step));
        },
        out);
    return;
  }
  if (region.element == 1) filter_list<std::uint8_t>(region, numbers, out);
  if (region.element == 2) filter_list<std::uint16_t>(region, numbers, out);
  if (region.element == 4) filter_list<std::uint32_t>(region, numbers, out);
  if (region.element == 8) filter_list<std::uint64_t>(region, numbers, out);
}

void unfilter_numbers(const Region& region, const std::uint8_t* filtered, std::uint8_t* out) {
  if (region.kind == RegionKind::grid) {
    const std::size_t count = region.size / sizeof(float);
    unfilter<std::uint32_t>(
        count, region.components, filtered,
        [&] {
          for (std::size_t i = 0; i < count; ++i)
            store(out, i,
                  on_grid(static_cast<std::int32_t>(load<std::uint32_t>(out, i)), region.step));
        },
        out);
    return;
  }
  if (region.element == 1) unfilter_list<std::uint8_t>(region, filtered, out);
  if (region.element == 2) unfilter_list<std::uint16_t>(region, filtered, out);
  if (region.element == 4) unfilter_list<std::uint32_t>(region, filtered, out);
  if (region.element == 8) unfilter_list<std::uint64_t>(region, filtered, out);
}

}  // namespace polyhull
