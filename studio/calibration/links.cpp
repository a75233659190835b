// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/links.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/median.h"
#include "studio/calibration/links_internal.h"

namespace polyhull::calibration {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

class Linker {
 public:
  Linker(Take& take, const std::vector<LensStart>& starts)
      : take_(take), starts_(starts), seen_(gather_views(take, starts)) {
    const std::size_t n = seen_.size();
    links_.assign(n, std::vector<Link>(n));
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b)
        if (a != b) links_[a][b] = link_of(take_.board, seen_[a], seen_[b]);
  }

  Placement place() {
    grow_tree();
    place_boards();
    return std::move(out_);
  }

 private:
  bool agrees(std::size_t a, std::size_t b) const {
    return links_[a][b].error <= contradiction_limit(seen_[b].camera);
  }

  // Whether quite another motion explains the views nearly as well.
  bool ambiguous(std::size_t a, std::size_t b) const {
    return take_.board.looks_same_turned() && links_[a][b].rival < 5.0 * links_[a][b].error + 2.0;
  }

  // Fewer instants say less.
  double cost(std::size_t a, std::size_t b) const {
    if (!agrees(a, b) || ambiguous(a, b)) return infinite;
    return (0.1 + links_[a][b].error) / std::sqrt(static_cast<double>(links_[a][b].instants));
  }

  void grow_tree() {
    const std::size_t n = seen_.size();
    out_.cameras.assign(n, {});
    std::vector<bool> placed(n, false);
    placed[out_.first] = true;
    for (std::size_t count = 1; count < n; ++count) {
      std::size_t from = n, to = n;
      double best = infinite;
      for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = 0; b < n; ++b)
          if (placed[a] && !placed[b] && cost(a, b) < best) {
            best = cost(a, b);
            from = a;
            to = b;
          }
      if (to == n) refuse(placed);
      placed[to] = true;
      out_.cameras[to] = links_[from][to].motion * out_.cameras[from];
    }
  }

  std::string names(const std::vector<bool>& which, bool wanted) const {
    std::string out;
    for (std::size_t c = 0; c < which.size(); ++c)
      if (which[c] == wanted) out += (out.empty() ? "'" : ", '") + take_.cameras[c].name + "'";
    return out;
  }

  // Says why no more cameras can be placed.
  [[noreturn]] void refuse(const std::vector<bool>& placed) const {
    std::size_t from = 0, to = 0, shared = 0;
    for (std::size_t a = 0; a < placed.size(); ++a)
      for (std::size_t b = 0; b < placed.size(); ++b)
        if (placed[a] && !placed[b] && links_[a][b].instants > shared) {
          shared = links_[a][b].instants;
          from = a;
          to = b;
        }
    if (shared == 0) {
      const bool few = 2 * std::ranges::count(placed, true) <= std::ssize(placed);
      throw Error(
          Error::Kind::bad_input,
          "No view of the board connects {} with {}: hold it where one of the first and one "
          "of the others see it at the same instant.",
          names(placed, few), names(placed, !few));
    }
    if (agrees(from, to))
      throw Error(
          Error::Kind::bad_input,
          "A board of {}x{} inner corners looks the same after half a turn, and the {} views "
          "that cameras '{}' and '{}' share do not tell which way round each saw it: take "
          "more of them, or a board with one row more.",
          take_.board.columns, take_.board.rows, shared, take_.cameras[from].name,
          take_.cameras[to].name);
    if (const std::optional<std::size_t> mirrored = find_mirrored(take_, starts_, {from, to}))
      throw Error(Error::Kind::bad_input,
                  "The pictures of camera '{}' look mirrored: reflected, they agree with the other "
                  "cameras. Switch off mirroring in the camera or recorder.",
                  take_.cameras[*mirrored].name);
    throw Error(
        Error::Kind::bad_input,
        "Cameras '{}' and '{}' contradict each other: the board moves otherwise before the "
        "one than before the other ({:.0f} px in {} shared views). Are their pictures of the "
        "same instants (does a video lack its first frames?), unmirrored, of one board, and did "
        "both cameras stand still?",
        take_.cameras[from].name, take_.cameras[to].name, links_[from][to].error, shared);
  }

  // Each instant's board stands where one of the cameras saw it: the one that the others, by the
  // median, contradict least.
  void place_boards() {
    const Board& board = take_.board;
    out_.boards.assign(take_.instants.size(), {});
    for (std::size_t i = 0; i < take_.instants.size(); ++i) {
      double best = infinite;
      for (std::size_t c = 0; c < seen_.size(); ++c) {
        if (!seen_[c].at[i].view) continue;
        const Pose pose = inverse(out_.cameras[c]) * seen_[c].at[i].pose;
        std::vector<double> errors;
        for (std::size_t d = 0; d < seen_.size(); ++d) {
          bool turned = false;
          if (seen_[d].at[i].view)
            errors.push_back(either_error(board, *seen_[d].at[i].view, seen_[d].camera,
                                          out_.cameras[d] * pose, &turned));
        }
        const double middle = median(std::move(errors));
        if (middle < best) {
          best = middle;
          out_.boards[i] = pose;
        }
      }
    }
    for (View& view : take_.views) {
      bool turned = false;
      either_error(board, view, seen_[view.camera].camera,
                   out_.cameras[view.camera] * out_.boards[view.instant], &turned);
      if (turned)
        for (int& id : view.ids) id = board.count() - 1 - id;
    }
  }

  Take& take_;
  const std::vector<LensStart>& starts_;
  std::vector<SeenViews> seen_;
  std::vector<std::vector<Link>> links_;  // [a][b]: from a to b
  Placement out_;
};

}  // namespace

Placement place_cameras(Take& take, const std::vector<LensStart>& starts) {
  return Linker(take, starts).place();
}

}  // namespace polyhull::calibration
