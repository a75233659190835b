// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/visibility.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

#include "texture/occlusion_map.h"
#include "texture/pieces.h"
#include "texture/texture_loops.h"

namespace polyhull {
namespace {

/// Coordinates of the samples' second and third corner: the R2 sequence (Roberts 2018), folded into
/// the triangle.
struct SamplePlaces {
  float b[2][PieceSamples::count];
};

const SamplePlaces& sample_places() {
  static const SamplePlaces places = [] {
    SamplePlaces made;
    double u = 1.0 / 3.0, v = 1.0 / 3.0;
    for (int i = 0; i < PieceSamples::count; ++i) {
      const bool folded = u + v > 1.0;
      made.b[0][i] = static_cast<float>(folded ? 1.0 - u : u);
      made.b[1][i] = static_cast<float>(folded ? 1.0 - v : v);
      u = std::fmod(u + 0.7548776662466927, 1.0);
      v = std::fmod(v + 0.5698402909980532, 1.0);
    }
    return made;
  }();
  return places;
}

/// What of a piece lies in the camera's frame.
enum class Framed : std::uint8_t { whole, partly, not_at_all };

/// A vector of floats as a grid, all 0.
DepthGrid clear_grid(std::vector<float>& texels, int width, int height) {
  DepthGrid grid;
  grid.width = width;
  grid.height = height;
  grid.stride = width + DepthGrid::padding;
  texels.assign(static_cast<std::size_t>(grid.stride) * height + DepthGrid::padding, 0.0f);
  grid.inverse = texels.data();
  return grid;
}

/// The texels on and around a piece, columns x0 .. x1 and rows y0 .. y1.
struct Window {
  int x0, x1, y0, y1;
};

/// The texel of \p v, the nearest of \p size; of what is no number the first.
int at(float v, int size) {
  return v > 0.0f ? static_cast<int>(std::min(v, static_cast<float>(size - 1))) : 0;
}

Window around(const PieceShape& s, int width, int height) {
  return {at(std::floor(s.left), width), at(std::ceil(s.right), width),
          at(std::floor(s.top), height), at(std::ceil(s.bottom), height)};
}

/// The texels nearest to what lies between its corners: a rim before a piece, or between it and a
/// texel around it, has one of these around the piece.
Window nearest(const PieceShape& s, int width, int height) {
  return {at(s.left + 0.5f, width), at(s.right + 0.5f, width), at(s.top + 0.5f, height),
          at(s.bottom + 0.5f, height)};
}

/// Makes texels at least \p value.
void raise(const DepthGrid& grid, const Window& w, float value) {
  for (int y = w.y0; y <= w.y1; ++y) {
    float* row = grid.inverse + static_cast<std::size_t>(y) * grid.stride;
    for (int x = w.x0; x <= w.x1; ++x) row[x] = std::max(row[x], value);
  }
}

}  // namespace

struct Seer::Scratch {
  const TextureLoops& loops;
  // The vertices on the grid.
  std::vector<float> x, y, inverse;
  int finer = 1;                  // texels of the grid per texel of the map
  DepthGrid grid;                 // depths
  DepthGrid rim_grid, rim_cells;  // of rims
  DepthGrid lost_grid;            // of what fell between texels
  std::vector<float> texels, rim_texels, rim_cell_values, lost_texels;
  std::vector<std::uint8_t>
      sides;  // of each vertex: 1: some of its triangles face the view, 2: not
  std::vector<Piece> pieces;
  std::vector<PieceShape> shapes;
  std::vector<Judged> judged;
  std::vector<std::uint8_t> own_rim;  // of each piece, 1: an edge of it is a rim
  std::vector<std::uint32_t> near;    // pieces close to rims
  std::vector<Framed> framed;         // of each piece; none where the frame holds all
  std::vector<std::uint8_t> outside;  // texels outside the frame
  PieceCells cells;
  std::vector<std::uint32_t> found;  // pieces that may hide one

  bool project(const Hull& hull, const Camera& camera, int map_size, OcclusionMap& map);
  void cut(const Hull& hull, const MeshFaces& faces, const Camera& camera, const Sight& sight);
  void frame_pieces(const Camera& camera, const OcclusionMap& map);
  void judge(float relative);
  void find_rims(const Hull& hull, const std::vector<float>& cosine);
  bool behind_rim(std::size_t piece) const;
  float share(std::size_t piece, const Camera& camera, const OcclusionMap& map);
  void judge_all(const Hull& hull, const Camera& camera, Sight& out);
  glm::dmat4x3 grid_from_local(const Hull& hull, const Camera& camera,
                               const OcclusionMap& map) const;
};

Seer::Seer(const TextureLoops& loops) : scratch_(new Scratch{loops}) {}
Seer::~Seer() = default;

/// Lays the view's map out and brings the vertices to the grid; false: the view sees nothing.
bool Seer::Scratch::project(const Hull& hull, const Camera& camera, int map_size,
                            OcclusionMap& map) {
  const std::size_t count = hull.vertices.size();
  for (auto* numbers : {&x, &y, &inverse}) numbers->resize(count);
  // K (R X + t) for X relative to the hull's origin, in one matrix.
  const Mat3 KR = camera.K * camera.R;
  const Vec3 shift = camera.K * camera.to_camera(hull.origin);
  double rows[3][4];
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rows[row][column] = KR[column][row];
    rows[row][3] = shift[row];
  }
  loops.project(rows, {count, &hull.vertices[0].x}, x.data(), y.data(), inverse.data());
  PictureBounds bounds;
  for (std::size_t i = 0; i < count; ++i) bounds.add(x[i], y[i], inverse[i]);
  map = lay_out_map(bounds, camera, map_size);
  if (map.width == 0) return false;
  // About a texel for each triangle, so that few fall between texels.
  const double wanted = std::clamp(std::sqrt(0.75 * hull.triangles.size()), 256.0, 2048.0);
  for (finer = 1; std::max(map.width, map.height) * finer < wanted;) finer *= 2;
  const float scale = static_cast<float>(finer) / map.step;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = (x[i] - map.x) * scale;
    y[i] = (y[i] - map.y) * scale;
  }
  grid = clear_grid(texels, map.width * finer, map.height * finer);
  return true;
}

glm::dmat4x3 Seer::Scratch::grid_from_local(const Hull& hull, const Camera& camera,
                                            const OcclusionMap& map) const {
  const double scale = finer / static_cast<double>(map.step);
  const Mat3 grid_from_pixel =
      from_rows({scale, 0, -map.x * scale, 0, scale, -map.y * scale, 0, 0, 1});
  const Mat3 linear = grid_from_pixel * camera.K * camera.R;
  const Vec3 shift = grid_from_pixel * camera.K * camera.to_camera(hull.origin);
  return {linear[0], linear[1], linear[2], shift};
}

/// The pieces of what faces the view.
void Seer::Scratch::cut(const Hull& hull, const MeshFaces& faces, const Camera& camera,
                        const Sight& sight) {
  pieces.clear();
  const auto right = static_cast<float>(grid.width - 1),
             bottom = static_cast<float>(grid.height - 1);
  const float largest = PieceCutter::largest(grid.width, grid.height);
  PieceCutter cutter(grid_from_local(hull, camera, sight.map), grid.width, grid.height, pieces);
  for (std::size_t f = 0; f < faces.area.size(); ++f) {
    if (sight.cosine[f] < -edge_on) continue;
    const std::uint32_t* at = &hull.triangles[3 * f];
    const std::uint32_t a = at[0], b = at[1], c = at[2];
    const float x0 = std::min({x[a], x[b], x[c]}), x1 = std::max({x[a], x[b], x[c]});
    const float y0 = std::min({y[a], y[b], y[c]}), y1 = std::max({y[a], y[b], y[c]});
    const bool before = inverse[a] > 0.0f && inverse[b] > 0.0f && inverse[c] > 0.0f;
    if (before && !(x0 <= right && x1 >= 0.0f && y0 <= bottom && y1 >= 0.0f)) continue;
    if (before && x1 - x0 <= largest && y1 - y0 <= largest)
      pieces.push_back({{x[a], x[b], x[c]},
                        {y[a], y[b], y[c]},
                        {inverse[a], inverse[b], inverse[c]},
                        static_cast<std::uint32_t>(f),
                        1.0f});
    else
      cutter.cut(static_cast<std::uint32_t>(f), hull.vertices[a], hull.vertices[b],
                 hull.vertices[c]);
  }
}

/// Which pieces the camera's frame holds.
void Seer::Scratch::frame_pieces(const Camera& camera, const OcclusionMap& map) {
  framed.clear();
  if (!leaves_frame(map, camera)) return;
  const float step = map.step / static_cast<float>(finer);
  outside.resize(static_cast<std::size_t>(grid.width) * grid.height);
  for (int row = 0; row < grid.height; ++row)
    for (int column = 0; column < grid.width; ++column)
      outside[static_cast<std::size_t>(row) * grid.width + column] =
          !in_frame(camera, {map.x + column * step, map.y + row * step}, 0.5);
  framed.resize(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Window w = around(shapes[i], grid.width, grid.height);
    int out = 0;
    for (int row = w.y0; row <= w.y1; ++row)
      for (int column = w.x0; column <= w.x1; ++column)
        out += outside[static_cast<std::size_t>(row) * grid.width + column];
    framed[i] = out == 0                                       ? Framed::whole
                : out == (w.x1 - w.x0 + 1) * (w.y1 - w.y0 + 1) ? Framed::not_at_all
                                                               : Framed::partly;
  }
}

/// Draws the rims of what faces the view, each a texel or two wide: the edges whose corners have
/// triangles on both sides. Nothing else can hide a part of a piece.
void Seer::Scratch::find_rims(const Hull& hull, const std::vector<float>& cosine) {
  sides.assign(hull.vertices.size(), 0);
  // Bytes may be anything: by these pointers, the compiler need not fetch the vectors' after each.
  std::uint8_t* const side_of = sides.data();
  const std::uint32_t* corner_of = hull.triangles.data();
  const float* const cosine_of = cosine.data();
  for (std::size_t f = 0, count = cosine.size(); f < count; ++f, corner_of += 3) {
    const std::uint8_t side = cosine_of[f] > 0.0f ? 1 : 2;
    side_of[corner_of[0]] |= side;
    side_of[corner_of[1]] |= side;
    side_of[corner_of[2]] |= side;
  }
  rim_grid = clear_grid(rim_texels, grid.width, grid.height);
  rim_cells = clear_grid(rim_cell_values, (grid.width + rim_cell - 1) / rim_cell,
                         (grid.height + rim_cell - 1) / rim_cell);
  own_rim.assign(pieces.size(), 0);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& p = pieces[i];
    const std::uint32_t* at = &hull.triangles[3 * static_cast<std::size_t>(p.triangle)];
    const int corner[3] = {sides[at[0]], sides[at[1]], sides[at[2]]};
    if ((corner[0] == 3) + (corner[1] == 3) + (corner[2] == 3) < 2) continue;
    for (int j = 0; j < 3; ++j) {
      const int k = (j + 1) % 3;
      if ((corner[j] & corner[k]) != 3) continue;
      own_rim[i] = 1;
      // Of a triangle in pieces, all of them.
      PieceShape edge = shapes[i];
      if (p.part == 1.0f) {
        std::tie(edge.left, edge.right) = std::minmax(p.x[j], p.x[k]);
        std::tie(edge.top, edge.bottom) = std::minmax(p.y[j], p.y[k]);
        edge.nearest = 0.5f * (p.inverse[j] + p.inverse[k]);
      }
      const Window w = nearest(edge, grid.width, grid.height);
      raise(rim_grid, w, edge.nearest);
      // Those of its cell and around it.
      raise(rim_cells,
            {std::max(w.x0 / rim_cell - 1, 0), std::min(w.x1 / rim_cell + 1, rim_cells.width - 1),
             std::max(w.y0 / rim_cell - 1, 0), std::min(w.y1 / rim_cell + 1, rim_cells.height - 1)},
            edge.nearest);
    }
  }
}

/// Whether a rim runs before the piece or close by.
bool Seer::Scratch::behind_rim(std::size_t i) const {
  const Piece& p = pieces[i];
  const float own =
      p.part < 1.0f ? shapes[i].farthest : (p.inverse[0] + p.inverse[1] + p.inverse[2]) / 3.0f;
  return loops.largest(shapes[i], rim_grid) > own;
}

/// Judges the pieces by the grid; \p relative as the loops have it.
void Seer::Scratch::judge(float relative) {
  judged.resize(pieces.size());
  near.resize(pieces.size());
  near.resize(loops.settle(pieces.data(), shapes.data(), pieces.size(), grid, rim_cells,
                           own_rim.data(), relative, judged.data(), near.data()));
  bool lost = false;
  for (const std::uint32_t i : near) {
    judged[i] = loops.judge(pieces[i], shapes[i], grid, relative);
    if (judged[i] != Judged::lost) continue;
    if (!lost) lost_grid = clear_grid(lost_texels, grid.width, grid.height);
    lost = true;
    raise(lost_grid, around(shapes[i], grid.width, grid.height), shapes[i].nearest);
  }
  for (const std::uint32_t i : near) {
    if (judged[i] == Judged::hidden) continue;
    // What fell between texels may hide what seems to be seen.
    if (judged[i] == Judged::seen && lost) {
      const Judged by_lost = loops.judge(pieces[i], shapes[i], lost_grid, relative);
      if (by_lost == Judged::open || by_lost == Judged::hidden) judged[i] = Judged::open;
    }
    if (judged[i] != Judged::seen) judged[i] = behind_rim(i) ? Judged::open : Judged::seen;
  }
}

/// How much of a piece points see.
float Seer::Scratch::share(std::size_t i, const Camera& camera, const OcclusionMap& map) {
  const Piece& piece = pieces[i];
  int count = 0;
  if (judged[i] != Judged::seen)
    cells.around(shapes[i], [&](const Occluders& occluders) {
      found.resize(std::max(found.size(), static_cast<std::size_t>(count + occluders.count)));
      count += loops.before(piece, shapes[i], occluders, pieces.data(), shapes.data(),
                            found.data() + count);
    });
  const bool partly = !framed.empty() && framed[i] == Framed::partly;
  if (count == 0 && !partly) return 1.0f;
  PieceSamples samples;
  loops.spread(piece, sample_places().b, samples);
  std::uint64_t hidden = loops.hidden(samples, found.data(), count, pieces.data(), shapes.data());
  if (partly) {
    const float step = map.step / static_cast<float>(finer);
    for (int s = 0; s < PieceSamples::count; ++s) {
      const Vec2 pixel(map.x + samples.x[s] * step, map.y + samples.y[s] * step);
      if (!in_frame(camera, pixel, 0.5)) hidden |= std::uint64_t{1} << s;
    }
  }
  return 1.0f - static_cast<float>(std::popcount(hidden)) / PieceSamples::count;
}

void Seer::Scratch::judge_all(const Hull& hull, const Camera& camera, Sight& out) {
  shapes.resize(pieces.size());
  loops.draw(pieces.data(), pieces.size(), grid, shapes.data());
  find_rims(hull, out.cosine);
  judge(out.map.step / static_cast<float>(finer) / static_cast<float>(camera.K[0][0]));
  frame_pieces(camera, out.map);
  cells.begin(grid.width, grid.height);
  bool any = false;
  for (const std::uint32_t i : near) {
    if (judged[i] != Judged::open) continue;
    any = true;
    cells.want(shapes[i]);
  }
  const auto add = [&](std::size_t i, float seen) {
    out.share[pieces[i].triangle] += pieces[i].part * seen;
  };
  const auto is_open = [&](std::size_t i) { return judged[i] == Judged::open; };
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (judged[i] != Judged::seen || !(out.cosine[pieces[i].triangle] > edge_on)) continue;
    const Framed in = framed.empty() ? Framed::whole : framed[i];
    if (in == Framed::not_at_all) continue;
    add(i, in == Framed::partly ? share(i, camera, out.map) : 1.0f);
  }
  out.pieces = pieces.size();
  if (!any) return;
  cells.fill(shapes);
  cells.each_piece(shapes, is_open, [&](std::size_t i) {
    if (!(out.cosine[pieces[i].triangle] > edge_on)) return;
    if (!framed.empty() && framed[i] == Framed::not_at_all) return;
    ++out.sampled;
    add(i, share(i, camera, out.map));
  });
}

void Seer::look(const Hull& hull, const MeshFaces& faces, const Camera& camera, int number,
                const SightSettings& settings, Sight& out) {
  Scratch& s = *scratch_;
  const std::size_t count = faces.area.size();
  out.share.assign(count, 0.0f);
  out.cosine.resize(count);
  out.sums.assign(2 * hull.vertices.size(), 0.0f);
  out.map = {};
  out.pieces = out.sampled = 0;
  const Vec3f eye(camera.centre() - hull.origin);
  s.loops.cosines({count, faces.nx.data(), faces.ny.data(), faces.nz.data(), faces.mx.data(),
                   faces.my.data(), faces.mz.data()},
                  &eye.x, out.cosine.data());
  for (std::size_t f = 0; f < count; ++f)
    if (faces.view[f] == number) out.cosine[f] = 0.0f;
  if (!settings.occlusion) {
    for (std::size_t f = 0; f < count; ++f) {
      if (!(out.cosine[f] > edge_on)) continue;
      const Vec3 middle(faces.mx[f], faces.my[f], faces.mz[f]);
      const auto pixel = camera.project_ideal(middle + hull.origin);
      out.share[f] = pixel && in_frame(camera, *pixel, 0.5) ? 1.0f : 0.0f;
    }
  } else if (s.project(hull, camera, settings.map_size, out.map)) {
    s.cut(hull, faces, camera, out);
    s.judge_all(hull, camera, out);
    if (settings.map) finish_map(s.grid, s.finer, camera, settings.fade_width, out.map, s.loops);
  }
  for (std::size_t f = 0; f < count; ++f) {
    if (!(out.cosine[f] > edge_on)) continue;
    const float area = faces.area[f], seen = area * out.share[f];
    for (int i = 0; i < 3; ++i) {
      float* sums = &out.sums[2 * static_cast<std::size_t>(hull.triangles[3 * f + i])];
      sums[0] += area;
      sums[1] += seen;
    }
  }
}

}  // namespace polyhull
