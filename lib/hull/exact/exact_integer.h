// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Signed integers of fixed width, wide enough for every predicate of the hull, so that no
/// predicate allocates and none can overflow. Widths are in 64-bit limbs, two's complement, least
/// limb first.
///
/// A plane is (a, b, c, o) with |a|,|b|,|c| < 2^80 and |o| < 2^126 (planes.h). A 2x2 minor of two
/// planes is below 2^208 and fits Int<4>; a 4x4 determinant is a sum of six products of two minors,
/// below 2^370 (only one minor of each product holds the offset column), and fits Int<8>.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace polyhull::hull {

// __int128 is an extension that every compiler for our machines has.
__extension__ typedef __int128 Int128;
__extension__ typedef unsigned __int128 Uint128;

template <std::size_t N>
struct Int {
  std::array<std::uint64_t, N> limb{};

  static Int from(Int128 value) {
    Int r;
    const std::uint64_t fill = value < 0 ? ~std::uint64_t{0} : 0;
    r.limb[0] = static_cast<std::uint64_t>(value);
    r.limb[1] = static_cast<std::uint64_t>(static_cast<Uint128>(value) >> 64);
    for (std::size_t i = 2; i < N; ++i) r.limb[i] = fill;
    return r;
  }

  bool negative() const { return (limb[N - 1] >> 63) != 0; }

  int sign() const {
    if (negative()) return -1;
    for (std::uint64_t l : limb)
      if (l != 0) return 1;
    return 0;
  }

  Int& operator+=(const Int& other) {
    Uint128 carry = 0;
    for (std::size_t i = 0; i < N; ++i) {
      carry += static_cast<Uint128>(limb[i]) + other.limb[i];
      limb[i] = static_cast<std::uint64_t>(carry);
      carry >>= 64;
    }
    return *this;
  }

  Int operator-() const {
    Int r;
    Uint128 carry = 1;
    for (std::size_t i = 0; i < N; ++i) {
      carry += static_cast<std::uint64_t>(~limb[i]);
      r.limb[i] = static_cast<std::uint64_t>(carry);
      carry >>= 64;
    }
    return r;
  }

  Int& operator-=(const Int& other) { return *this += -other; }

  /// The nearest double, to about one unit in the last place; \p exponent is added to its exponent.
  double to_double(int exponent = 0) const {
    const Int magnitude = negative() ? -*this : *this;
    double value = 0.0;
    for (std::size_t i = N; i-- > 0;) {
      if (magnitude.limb[i] == 0) continue;
      value +=
          std::ldexp(static_cast<double>(magnitude.limb[i]), static_cast<int>(64 * i) + exponent);
    }
    return negative() ? -value : value;
  }
};

/// The exact product; magnitudes multiply as unsigned and the sign is put back.
template <std::size_t N>
Int<2 * N> multiply(const Int<N>& x, const Int<N>& y) {
  const bool negative = x.negative() != y.negative();
  const Int<N> a = x.negative() ? -x : x;
  const Int<N> b = y.negative() ? -y : y;
  Int<2 * N> r;
  for (std::size_t i = 0; i < N; ++i) {
    std::uint64_t carry = 0;
    for (std::size_t k = 0; k < N; ++k) {
      const Uint128 t = static_cast<Uint128>(a.limb[i]) * b.limb[k] + r.limb[i + k] + carry;
      r.limb[i + k] = static_cast<std::uint64_t>(t);
      carry = static_cast<std::uint64_t>(t >> 64);
    }
    r.limb[i + N] = carry;
  }
  return negative ? -r : r;
}

/// a d - b c of 128-bit numbers, exactly.
inline Int<4> minor(Int128 a, Int128 b, Int128 c, Int128 d) {
  Int<4> r = multiply(Int<2>::from(a), Int<2>::from(d));
  r -= multiply(Int<2>::from(b), Int<2>::from(c));
  return r;
}

}  // namespace polyhull::hull
