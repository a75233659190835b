// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/projection_matrix.h"

#include <cmath>

#include "base/error.h"

namespace polyhull {
namespace {

Vec3 row(const ProjectionMatrix& m, int i) {
  return {m[i][0], m[i][1], m[i][2]};
}

double determinant(const ProjectionMatrix& m) {
  return glm::dot(row(m, 0), glm::cross(row(m, 1), row(m, 2)));
}

double size(const ProjectionMatrix& m) {
  return glm::length(row(m, 0)) * glm::length(row(m, 1)) * glm::length(row(m, 2));
}

// Singular up to rounding. Rows of a normal camera are far from orthogonal (focal length in front
// of one): the determinant is about (f / c)^2 of their product, 1e-12 only for absurd ones.
bool singular(const ProjectionMatrix& m) {
  return !(std::abs(determinant(m)) > 1e-13 * size(m));
}

// Rows of one length, orthogonal to each other: a focal length of one pixel and a principal point in
// the first one.
bool is_pose(const ProjectionMatrix& m) {
  constexpr double rounding = 1e-3;
  const double square = glm::dot(row(m, 2), row(m, 2));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j)
      if (std::abs(glm::dot(row(m, i), row(m, j)) - (i == j ? square : 0.0)) > rounding * square)
        return false;
  return true;
}

Vec3 centre(const ProjectionMatrix& m) {
  const Vec3 a = row(m, 0), b = row(m, 1), c = row(m, 2);
  return -(m[0][3] * glm::cross(b, c) + m[1][3] * glm::cross(c, a) + m[2][3] * glm::cross(a, b)) /
         determinant(m);
}

// P = K [R | t] with its last row as it is (of length 1) has the sign of its depths: a camera of a
// right-handed world that looks along -z has the scene behind it. Another P may have been multiplied
// by a negative number.
[[noreturn]] void fail_handedness(double sign, double last_row, const std::string& where) {
  const bool signed_depth = std::abs(last_row - 1.0) < 0.01;
  if (signed_depth && sign < 0.0)
    throw Error(Error::Kind::bad_input,
                "{}: P has the scene behind the camera, as OpenGL's and Blender's cameras have it "
                "(y up, looking along -z). Make P of a camera with y down and z forward: negate "
                "the second and third rows of every camera's [R | t] before K is multiplied.",
                where);
  throw Error(Error::Kind::bad_input,
              "{}: P belongs to a left-handed frame (its determinant is negative while the scene "
              "lies at positive depth). Mirror the world: negate the third column of every "
              "camera's P (which turns Z into -Z), or re-export the calibration with a "
              "right-handed world and pixels counted from the top left.{}",
              where,
              signed_depth ? ""
                           : " Of OpenGL's cameras (y up, looking along -z) negate the second and "
                             "third rows of [R | t] instead, before K is multiplied.");
}

}  // namespace

std::optional<Vec3> common_focus(std::span<const ProjectionMatrix> matrices) {
  Mat3 sum(0.0);
  Vec3 right(0.0);
  int count = 0;
  for (const ProjectionMatrix& m : matrices) {
    if (singular(m)) continue;
    const Vec3 axis = glm::normalize(row(m, 2));
    const Mat3 across = Mat3(1.0) - glm::outerProduct(axis, axis);
    sum += across;
    right += across * centre(m);
    ++count;
  }
  if (count < 2 || !(glm::determinant(sum) > 1e-9 * count * count * count)) return std::nullopt;
  return glm::inverse(sum) * right;
}

void set_projection(Camera& camera, const ProjectionMatrix& matrix, std::optional<Vec3> focus,
                    const std::string& where) {
  for (const auto& r : matrix)
    for (const double value : r)
      if (!std::isfinite(value))
        throw Error(Error::Kind::bad_input, "{}: P has a number that is not finite.", where);
  if (singular(matrix))
    throw Error(Error::Kind::bad_input,
                "{}: the left 3x3 block of P is singular, so P is no camera with a centre; check "
                "the order of its 12 numbers (three rows of four).",
                where);
  if (is_pose(matrix))
    throw Error(
        Error::Kind::bad_input,
        "{}: P is a pose [R | t] without a lens: its left 3x3 block is a rotation. Multiply "
        "each camera's K from the left, in pixels, with [R | t] from the world to the camera "
        "(x right, y down, z forward).",
        where);
  double sign = 1.0;
  if (focus) sign = glm::dot(row(matrix, 2), *focus) + matrix[2][3] < 0.0 ? -1.0 : 1.0;
  if (sign * determinant(matrix) < 0.0) fail_handedness(sign, glm::length(row(matrix, 2)), where);
  const double scale = sign / glm::length(row(matrix, 2));
  const Vec3 m1 = scale * row(matrix, 0), m2 = scale * row(matrix, 1), m3 = scale * row(matrix, 2);
  const double cx = glm::dot(m1, m3), cy = glm::dot(m2, m3);
  const Vec3 across = m2 - cy * m3;
  const double fy = glm::length(across);
  const Vec3 r2 = across / fy;
  const double skew = glm::dot(m1, r2);
  const Vec3 along = m1 - cx * m3 - skew * r2;
  const double fx = glm::length(along);
  const Vec3 r1 = along / fx;
  camera.K = from_rows({fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0});
  camera.R = from_rows({r1.x, r1.y, r1.z, r2.x, r2.y, r2.z, m3.x, m3.y, m3.z});
  const double tz = scale * matrix[2][3];
  const double ty = (scale * matrix[1][3] - cy * tz) / fy;
  const double tx = (scale * matrix[0][3] - skew * ty - cx * tz) / fx;
  camera.t = Vec3(tx, ty, tz);
}

}  // namespace polyhull
