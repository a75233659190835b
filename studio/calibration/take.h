// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What calibration starts from: a flat board of known size, seen by cameras at several instants.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rig/camera.h"

namespace polyhull::calibration {

/// A flat board of squares. Its corners are the inner ones, where four squares meet; corner
/// row * columns + column lies at (column, row, 0) * square. Seen from its front x goes right, y
/// down and z away from who looks.
struct Board {
  int columns = 0;      ///< inner corners along x
  int rows = 0;         ///< inner corners along y
  double square = 0.0;  ///< a square's side, metres
  bool named = false;   ///< whether corners tell their number (ChArUco), so that parts are enough

  int count() const { return columns * rows; }
  Vec3 corner(int id) const { return square * Vec3(id % columns, id / columns, 0.0); }
  Vec3 middle() const { return square * 0.5 * Vec3(columns - 1, rows - 1, 0.0); }

  /// Whether the board looks the same after half a turn: a chessboard whose numbers of corners are
  /// both even or both odd.
  bool looks_same_turned() const { return !named && (columns + rows) % 2 == 0; }
};

/// The board in one camera's picture. Several corners, in any order.
struct View {
  std::size_t camera = 0;     ///< index into Take::cameras
  std::size_t instant = 0;    ///< index into Take::instants
  std::vector<int> ids;       ///< numbers of the corners
  std::vector<Vec2> corners;  ///< where they are, pixels
};

/// A camera to calibrate.
struct TakeCamera {
  std::string name;
  int width = 0;                ///< pixels
  int height = 0;               ///< pixels
  std::optional<Camera> known;  ///< whose K and distortion are kept instead of estimated
};

struct Take {
  Board board;
  std::vector<TakeCamera> cameras;
  std::vector<std::string> instants;  ///< their names
  std::vector<View> views;            ///< at most one per camera and instant
};

/// Least number of views with which a camera's lens is estimated.
constexpr std::size_t least_views = 4;

/// Throws Error (bad_input) for a board with fewer than 3x3 corners, a chessboard with as many columns
/// as rows, and squares whose side is not 0.1 mm to 10 m.
void check_board(const Board& board);

/// Throws Error (bad_input), naming camera or instant, for what cannot be calibrated whatever the
/// pixels say: no camera, a board with fewer than 3x3 corners, as many columns as rows or squares
/// of no such side, corners that the board does not have or that come twice, views with fewer than 6
/// corners, two views of a camera at one instant, pixels that are not finite, cameras without a
/// view, and cameras without a known lens that have fewer than `least_views`.
void check_take(const Take& take);

}  // namespace polyhull::calibration
