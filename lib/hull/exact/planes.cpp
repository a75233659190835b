// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/exact/planes.h"

#include <algorithm>

namespace polyhull::hull {
namespace {

/// The six 2x2 minors of two rows, columns (0,1) (0,2) (0,3) (1,2) (1,3) (2,3).
std::array<Int<4>, 6> minors(const Plane& p, const Plane& q) {
  return {minor(p.a, p.b, q.a, q.b), minor(p.a, p.c, q.a, q.c), minor(p.a, p.o, q.a, q.o),
          minor(p.b, p.c, q.b, q.c), minor(p.b, p.o, q.b, q.o), minor(p.c, p.o, q.c, q.o)};
}

/// Sorts three or four plane numbers; returns the sign of the permutation.
template <std::size_t N>
int sort_numbers(std::array<std::uint32_t, N>& numbers) {
  int sign = 1;
  for (std::size_t i = 1; i < N; ++i)
    for (std::size_t k = i; k > 0 && numbers[k - 1] > numbers[k]; --k) {
      std::swap(numbers[k - 1], numbers[k]);
      sign = -sign;
    }
  return sign;
}

/// The planes, or perturbations of them, of a determinant's term. Bit k of the subset stands for the k-th
/// lowest number, whose infinitesimal is the k-th largest, so counting upwards visits the terms from the
/// largest to the smallest. False: a plane has no perturbation, and there is no such term.
template <std::size_t count>
bool find_term(const PlaneSet& of, const std::array<std::uint32_t, count>& id, unsigned subset,
               std::array<const Plane*, count>& row) {
  for (unsigned k = 0; k < count; ++k) {
    const std::int32_t g = of.group[id[k]];
    const bool perturbed = subset >> k & 1;
    if (perturbed && g < 0) return false;
    row[k] = perturbed ? &of.perturbation[g] : &of.planes[id[k]];
  }
  return true;
}

}  // namespace

int determinant_sign(const Plane& p0, const Plane& p1, const Plane& p2, const Plane& p3) {
  const auto m = minors(p0, p1);
  const auto n = minors(p2, p3);
  // Laplace expansion along the first two rows.
  Int<8> sum = multiply(m[0], n[5]);
  sum -= multiply(m[1], n[4]);
  sum += multiply(m[2], n[3]);
  sum += multiply(m[3], n[2]);
  sum -= multiply(m[4], n[1]);
  sum += multiply(m[5], n[0]);
  return sum.sign();
}

int PlaneSet::orientation(std::uint32_t p0, std::uint32_t p1, std::uint32_t p2,
                          std::uint32_t p3) const {
  std::array<std::uint32_t, 4> id{p0, p1, p2, p3};
  const int permutation = sort_numbers(id);
  for (unsigned subset = 0; subset < 16; ++subset) {
    std::array<const Plane*, 4> row;
    if (!find_term(*this, id, subset, row)) continue;
    const int sign = determinant_sign(*row[0], *row[1], *row[2], *row[3]);
    if (sign != 0) return permutation * sign;
  }
  return 0;
}

Vec3 PlaneSet::point(std::uint32_t p0, std::uint32_t p1, std::uint32_t p2) const {
  std::array<std::uint32_t, 3> id{p0, p1, p2};
  sort_numbers(id);
  for (unsigned subset = 0; subset < 8; ++subset) {
    std::array<const Plane*, 3> row;
    if (!find_term(*this, id, subset, row)) continue;
    // The point is the vector of signed 3x3 minors; the last is the determinant of the normals.
    const auto m = minors(*row[0], *row[1]);
    const auto term = [&](int i, Int128 value) { return multiply(m[i], Int<4>::from(value)); };
    const Plane& r = *row[2];
    Int<8> w = term(0, r.c);
    w -= term(1, r.b);
    w += term(3, r.a);
    if (w.sign() == 0) continue;
    Int<8> x = term(3, r.o);
    x -= term(4, r.c);
    x += term(5, r.b);
    Int<8> y = term(1, r.o);
    y -= term(2, r.c);
    y += term(5, r.a);
    Int<8> z = term(0, r.o);
    z -= term(2, r.b);
    z += term(4, r.a);
    const double d = w.to_double(-256);
    return {-x.to_double(-256) / d, y.to_double(-256) / d, -z.to_double(-256) / d};
  }
  return Vec3(0.0);
}

int PlaneSet::side_of_point(std::uint32_t p, Int128 x, Int128 y, Int128 z) const {
  const auto value = [&](const Plane& plane) {
    Int<4> sum = multiply(Int<2>::from(plane.a), Int<2>::from(x));
    sum += multiply(Int<2>::from(plane.b), Int<2>::from(y));
    sum += multiply(Int<2>::from(plane.c), Int<2>::from(z));
    sum += Int<4>::from(plane.o);
    return sum.sign();
  };
  const int sign = value(planes[p]);
  if (sign != 0 || group[p] < 0) return sign;
  return value(perturbation[group[p]]);
}

}  // namespace polyhull::hull
