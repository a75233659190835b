// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/input.h"

#include <cmath>

#include "base/error.h"

namespace polyhull::refine {
namespace {

constexpr double most_nodes = 64e6;

bool finite(const CameraContours& view) {
  double sum = 0.0;
  const auto add = [&](double value) { sum += value * 0.0; };
  for (int i = 0; i < 3; ++i) {
    add(view.camera->t[i]);
    for (int k = 0; k < 3; ++k) add(view.camera->K[i][k] + view.camera->R[i][k]);
  }
  for (const Vec2f& point : view.rings->points) add(static_cast<double>(point.x) + point.y);
  return sum == 0.0;
}

/// Throws Error unless each view has a picture.
void check_pictures(std::span<const CameraContours> views, std::span<const ViewPixels> pictures) {
  for (std::size_t k = 0; k < views.size(); ++k)
    if (k >= pictures.size() || pictures[k].pixels == nullptr || pictures[k].roi.empty())
      throw Error(Error::Kind::bad_input,
                  "Camera {} sends no picture, by which photo-consistency is judged.",
                  views[k].camera->name);
}

}  // namespace

void check_input(std::span<const CameraContours> views, double metres_per_unit,
                 const RefineSettings& settings, std::span<const ViewPixels> pictures) {
  if (!(metres_per_unit > 0.0) || !std::isfinite(metres_per_unit))
    throw Error(Error::Kind::bad_input, "A mesh has {:g} metres to a unit: expected more than 0.",
                metres_per_unit);
  if (!(settings.cell >= 0.0) || !std::isfinite(settings.cell))
    throw Error(Error::Kind::bad_input, "The refined surface's cell is {:g} m: expected 0 or more.",
                settings.cell);
  for (const CameraContours& view : views)
    if (!finite(view))
      throw Error(Error::Kind::bad_input, "Camera {}: its calibration or a contour is not finite.",
                  view.camera->name);
  if (settings.photo) check_pictures(views, pictures);
}

void check_size(const std::vector<Box>& boxes, int margin, double cell) {
  double nodes = 0.0;
  for (const Box& box : boxes) {
    const Vec3 size = Vec3(box.high - box.low) + 2.0 * margin;
    nodes += 8.0 * size.x * size.y * size.z;
  }
  if (nodes < most_nodes) return;
  if (!(nodes < 1e30))
    throw Error(
        Error::Kind::unsupported,
        "The hull is far too large for a cell of {:g} m: give a larger one, or bounds around "
        "the subject.",
        cell);
  throw Error(Error::Kind::unsupported,
              "The hull is too large for a cell of {:g} m: its grids would have {:.0f} million "
              "nodes; give a cell of {:.3f} m or more, or bounds around the subject.",
              cell, 1e-6 * nodes, cell * std::cbrt(nodes / most_nodes) * 1.05);
}

}  // namespace polyhull::refine
