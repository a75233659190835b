// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/calibration_takes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "rig/lens.h"

namespace polyhull::calibration {
namespace {

using Random = std::mt19937;

double uniform(Random& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random()) + 0.5) / 4294967296.0;
}

// A pose from axes: x right, y down, z away.
Mat3 looking(const Vec3& forward, double roll) {
  const Vec3 z = glm::normalize(forward);
  const Vec3 x = glm::normalize(glm::cross(z, Vec3(0.0, 1.0, 0.0)));
  const Vec3 y = glm::cross(z, x);
  return {std::cos(roll) * x + std::sin(roll) * y, std::cos(roll) * y - std::sin(roll) * x, z};
}

Camera ring_camera(const RingSettings& settings, int c, Random& random) {
  Camera camera;
  camera.name = fmt::format("cam{}", c);
  camera.width = settings.width;
  camera.height = settings.height;
  const double focal = 0.78 * settings.width * uniform(random, 0.97, 1.03);
  camera.K = from_rows({focal, 0.0, 0.5 * settings.width + uniform(random, -15.0, 15.0), 0.0,
                        focal * uniform(random, 0.999, 1.001),
                        0.5 * settings.height + uniform(random, -15.0, 15.0), 0.0, 0.0, 1.0});
  camera.distortion = {uniform(random, -0.12, -0.08), uniform(random, 0.05, 0.08),
                       uniform(random, -1e-3, 1e-3), uniform(random, -1e-3, 1e-3), 0.0};
  const double azimuth =
      2.0 * std::numbers::pi * (c + uniform(random, -0.1, 0.1)) / settings.cameras;
  const Vec3 centre(4.0 * std::sin(azimuth), uniform(random, 1.0, 2.0), 4.0 * std::cos(azimuth));
  const Mat3 axes = looking(Vec3(0.0, 1.0, 0.0) - centre, uniform(random, -0.05, 0.05));
  camera.R = glm::transpose(axes);
  camera.t = -(camera.R * centre);
  return camera;
}

void add_views(TrueTake& truth, double noise, Random& random) {
  std::normal_distribution<double> gauss(0.0, 1.0);
  const Pose& pose = truth.boards.back();
  const Board& board = truth.take.board;
  for (std::size_t c = 0; c < truth.cameras.size(); ++c) {
    const Camera& camera = truth.cameras[c];
    View view{c, truth.boards.size() - 1, {}, {}};
    const Vec3 away = glm::normalize(pose(board.middle()) - camera.centre());
    if (glm::dot(pose.R[2], away) < 0.5) continue;
    for (int i = 0; i < board.count(); ++i) {
      const auto pixel = camera.project(pose(board.corner(i)));
      if (!pixel || pixel->x < 10.0 || pixel->y < 10.0 || pixel->x > camera.width - 11.0 ||
          pixel->y > camera.height - 11.0)
        break;
      view.ids.push_back(i);
      const double dx = noise * gauss(random), dy = noise * gauss(random);
      view.corners.push_back(*pixel + Vec2(dx, dy));
    }
    if (static_cast<int>(view.ids.size()) == board.count()) truth.take.views.push_back(view);
  }
}

void add_board(TrueTake& truth, const Mat3& axes, const Vec3& middle, const std::string& name) {
  truth.boards.push_back({axes, middle - axes * truth.take.board.middle()});
  truth.take.instants.push_back(name);
}

// A board before one camera that fills half of the width of its picture or more, tilted.
void add_near_view(TrueTake& truth, int i, double noise, Random& random) {
  const Camera& camera = truth.cameras[i % truth.cameras.size()];
  const Board& board = truth.take.board;
  const double wide = board.square * board.columns;
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const double z = wide * uniform(random, 1.2, 2.0);
    const Vec3 middle(z * uniform(random, -0.5, 0.5), z * uniform(random, -0.3, 0.3), z);
    const double lean = uniform(random, 0.3, 0.8), way = uniform(random, 0.0, 6.3);
    const Vec3 forward(std::tan(lean) * std::cos(way), std::tan(lean) * std::sin(way), 1.0);
    const Mat3 axes = glm::transpose(camera.R) * looking(-forward, 0.0);
    const Mat3 front(-axes[0], axes[1], -axes[2]);
    const std::size_t views = truth.take.views.size();
    add_board(truth, front, glm::transpose(camera.R) * (middle - camera.t),
              fmt::format("near {}", i));
    add_views(truth, noise, random);
    for (std::size_t v = views; v < truth.take.views.size(); ++v)
      if (truth.take.views[v].camera == i % truth.cameras.size()) return;
    truth.take.views.resize(views);
    truth.boards.pop_back();
    truth.take.instants.pop_back();
  }
}

// The rotation vector of a small rotation.
Vec3 turn_of(const Mat3& R) {
  return 0.5 * Vec3(R[1][2] - R[2][1], R[2][0] - R[0][2], R[0][1] - R[1][0]);
}

}  // namespace

TrueTake make_ring(const RingSettings& settings) {
  Random random(settings.seed);
  TrueTake truth;
  truth.take.board = settings.board;
  for (int c = 0; c < settings.cameras; ++c) {
    truth.cameras.push_back(ring_camera(settings, c, random));
    const Camera& camera = truth.cameras.back();
    truth.take.cameras.push_back({camera.name, camera.width, camera.height, {}});
  }
  for (int i = 0; i < settings.instants; ++i) {
    const double facing = uniform(random, 0.0, 2.0 * std::numbers::pi);
    const double lean = uniform(random, -0.6, 0.6);
    const Mat3 axes = looking(Vec3(std::sin(facing), std::tan(lean), std::cos(facing)),
                              uniform(random, -0.5, 0.5));
    const Vec3 middle(uniform(random, -1.6, 1.6), uniform(random, 0.2, 1.9),
                      uniform(random, -1.6, 1.6));
    add_board(truth, axes, middle, fmt::format("{:04}", i));
    add_views(truth, settings.noise, random);
  }
  for (int i = 0; i < settings.near_views * settings.cameras; ++i)
    add_near_view(truth, i, settings.noise, random);
  return truth;
}

void add_floor_view(TrueTake& truth, double noise, unsigned seed) {
  Random random(seed);
  // Board x along the world's x, its y along z, its z downwards.
  add_board(truth, Mat3(Vec3(1.0, 0.0, 0.0), Vec3(0.0, 0.0, 1.0), Vec3(0.0, -1.0, 0.0)), Vec3(0.0),
            "floor");
  std::normal_distribution<double> gauss(0.0, 1.0);
  const Pose& pose = truth.boards.back();
  for (std::size_t c = 0; c < truth.cameras.size(); ++c) {
    View view{c, truth.boards.size() - 1, {}, {}};
    for (int i = 0; i < truth.take.board.count(); ++i) {
      const double dx = noise * gauss(random), dy = noise * gauss(random);
      view.ids.push_back(i);
      view.corners.push_back(*truth.cameras[c].project(pose(truth.take.board.corner(i))) +
                             Vec2(dx, dy));
    }
    truth.take.views.push_back(view);
  }
}

void add_parallel_view(TrueTake& truth, int i, double noise) {
  Random random(static_cast<unsigned>(100 + i));
  const Camera& camera = truth.cameras[0];
  const Vec3 middle(0.3 * (i % 5 - 2), 0.2 * (i % 3 - 1), 2.0 + 0.1 * i);
  add_board(truth, glm::transpose(camera.R), glm::transpose(camera.R) * (middle - camera.t),
            fmt::format("parallel {}", i));
  add_views(truth, noise, random);
}

CameraError error_of(const Camera& found, const Camera& truth) {
  CameraError out;
  out.centre = found.centre() - truth.centre();
  out.rotation = turn_of(glm::transpose(found.R) * truth.R);
  const Mat3 &a = found.K, &b = truth.K;
  out.lens = {a[0][0] - b[0][0], a[1][1] - b[1][1], a[2][0] - b[2][0], a[2][1] - b[2][1]};
  for (std::size_t i = 0; i < 5; ++i)
    out.lens[4 + i] = (i < found.distortion.size() ? found.distortion[i] : 0.0) -
                      (i < truth.distortion.size() ? truth.distortion[i] : 0.0);
  return out;
}

std::vector<CameraError> errors_of(const std::vector<Camera>& found,
                                   const std::vector<Camera>& truth) {
  const double n = static_cast<double>(found.size());
  // From the truth's world to the result's: first as the first camera says, then two steps towards
  // the least squares.
  Pose move = inverse(Pose{found[0].R, found[0].t}) * Pose{truth[0].R, truth[0].t};
  Vec3 middle(0.0);
  for (const Camera& camera : found) middle += camera.centre() / n;
  double radius = 0.0;
  for (const Camera& camera : found) radius += glm::length(camera.centre() - middle) / n;
  std::vector<CameraError> out;
  for (int step = 0; step < 4; ++step) {
    out.clear();
    Vec3 shift(0.0), right(0.0);
    Mat3 normal(n * std::max(1e-12, radius * radius));
    for (std::size_t c = 0; c < found.size(); ++c) {
      Camera moved = truth[c];
      const Pose pose = Pose{moved.R, moved.t} * inverse(move);
      moved.R = pose.R;
      moved.t = pose.t;
      out.push_back(error_of(found[c], moved));
      const Vec3 arm = found[c].centre() - middle;
      shift += out.back().centre / n;
      right += glm::cross(arm, out.back().centre) + radius * radius * out.back().rotation;
      normal += Mat3(glm::dot(arm, arm)) - glm::outerProduct(arm, arm);
    }
    const Vec3 turn = glm::inverse(normal) * right;
    const double angle = glm::length(turn);
    const Pose about{from_parameters(std::array{turn.x, turn.y, turn.z, 0.0, 0.0, 0.0}.data()).R,
                     Vec3(0.0)};
    if (angle > 0.0)
      move = Pose{Mat3(1.0), middle + shift} * about * Pose{Mat3(1.0), -middle} * move;
  }
  return out;
}

Picture render_board(const Picture& drawing, const Board& board, const Pose& pose,
                     const Camera& camera) {
  constexpr int samples = 3;
  const Lens lens(camera);
  const Mat3 inverse_K = glm::inverse(camera.K);
  const Pose before = Pose{camera.R, camera.t} * pose;
  const double square = static_cast<double>(drawing.width) / (board.columns + 3);
  Picture out{camera.width, camera.height, 1, {}};
  out.pixels.assign(static_cast<std::size_t>(out.width) * out.height, 110);
  // The rectangle in which the drawing lies.
  Vec2 low(1e9), high(-1e9);
  for (const double x : {-2.0, board.columns + 1.0}) {
    for (const double y : {-2.0, board.rows + 1.0}) {
      const Vec3 seen = before(board.square * Vec3(x, y, 0.0));
      if (seen.z < 0.05) return out;
      const Vec2 pixel = lens.distort(Vec2(camera.K * (seen / seen.z)));
      low = glm::min(low, pixel - 20.0);
      high = glm::max(high, pixel + 20.0);
    }
  }
  // The plane's point of a ray, in the board's axes: what the homography's inverse says.
  const Mat3 plane = glm::inverse(Mat3(before.R[0], before.R[1], before.t));
  for (int v = std::max(0, static_cast<int>(low.y)); v < std::min<double>(out.height, high.y);
       ++v) {
    for (int u = std::max(0, static_cast<int>(low.x)); u < std::min<double>(out.width, high.x);
         ++u) {
      // The lens bends a pixel's samples alike.
      const Vec2 ideal = lens.undistort(Vec2(u, v));
      const Vec2 step = lens.undistort(Vec2(u + 1.0, v + 1.0)) - ideal;
      double sum = 0.0;
      for (int s = 0; s < samples * samples; ++s) {
        // No two samples in one row or column, so that upright edges have as many levels.
        const double i = s % samples, j = s / samples;
        const double shift = 0.5 * (samples - 1);
        const Vec2 offset(((i + 0.5) + (j - shift) / samples) / samples - 0.5,
                          ((j + 0.5) + (shift - i) / samples) / samples - 0.5);
        const Vec3 p = plane * (inverse_K * Vec3(ideal + step * offset, 1.0));
        const int x = static_cast<int>(std::floor((p.x / p.z / board.square + 2.0) * square));
        const int y = static_cast<int>(std::floor((p.y / p.z / board.square + 2.0) * square));
        const bool on = x >= 0 && y >= 0 && x < drawing.width && y < drawing.height;
        sum += on ? 30.0 + 0.75 * drawing.row(y)[x] : 110.0;
      }
      out.row(v)[u] = static_cast<std::uint8_t>(std::lround(sum / (samples * samples)));
    }
  }
  return out;
}

}  // namespace polyhull::calibration
