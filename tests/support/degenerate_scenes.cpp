// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/degenerate_scenes.h"

#include <algorithm>
#include <cmath>

#include "support/scenes.h"

namespace polyhull::test {
namespace {

const Bounds unit_box{Vec3(-1.0), Vec3(1.0)};

std::vector<Vec2f> rectangle(float left, float top, float right, float bottom) {
  return {
      {left, top}, {left, bottom}, {right, bottom}, {right, top}};  // counter-clockwise on screen
}

std::vector<Vec2f> turned(std::vector<Vec2f> ring) {
  std::reverse(ring.begin(), ring.end());
  return ring;
}

Rings one(const std::vector<Vec2f>& ring) {
  Rings rings;
  add_ring(rings, ring);
  return rings;
}

/// Cameras with their rings, and bounds around them.
struct Builder {
  HullScene scene;
  Builder() { scene.rig.bounds = Bounds{Vec3(-2.0), Vec3(2.0)}; }
  Builder& add(Camera camera, Rings rings) {
    camera.name = "cam" + std::to_string(scene.rig.cameras.size());
    scene.rig.cameras.push_back(std::move(camera));
    scene.silhouettes.push_back(std::move(rings));
    return *this;
  }
  Builder& see(Camera camera, const std::vector<Vec3>& body) {
    Rings rings = one(outline_of(body, camera));
    return add(std::move(camera), std::move(rings));
  }
};

Camera at(const Vec3& centre, int axis, double focal = 1024) {
  return axis_camera("", centre, axis, focal);
}

/// The figure's usual three cameras on the axes, seeing a box.
Builder three_axes() {
  Builder b;
  b.see(at({0, 0, -4}, 5), corners_of(unit_box));
  b.see(at({-4, 0, 0}, 1), corners_of(unit_box));
  b.see(at({0, -4, 0}, 3), corners_of(unit_box));
  return b;
}

/// Replaces the first silhouette of three_axes().
HullScene with(const Rings& rings) {
  Builder b = three_axes();
  b.scene.silhouettes[0] = rings;
  return b.scene;
}

Rings many_squares(int columns, int rows, float size, float pitch) {
  Rings rings;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const float x = 512 + (i - columns / 2) * pitch, y = 384 + (j - rows / 2) * pitch;
      add_ring(rings, rectangle(x, y, x + size, y + size));
    }
  }
  return rings;
}

void add_epipoles(std::vector<DegenerateScene>& all) {
  // Camera 1 stands in front of camera 0, whose image of it is (512 + 1024 x / 2, 384 + 1024 y /
  // 2).
  const auto epipole = [&](const char* name, Vec3 centre, const std::vector<Vec2f>& ring) {
    Builder b;
    b.add(at({0, 0, -4}, 5), one(ring));
    b.see(at(centre, 5), corners_of({Vec3(-0.5), Vec3(0.5)}));
    b.see(at({-4, 0, 0}, 1), corners_of(unit_box));
    all.push_back({name, b.scene});
  };
  epipole("epipole inside", {0, 0, -2}, rectangle(300, 200, 700, 600));
  epipole("epipole on border", {0, 0, -2}, rectangle(512, 200, 700, 600));
  epipole("epipole on vertex", {0, 0, -2}, rectangle(512, 384, 700, 600));
  epipole("epipole on the line of an edge", {0, 0, -2}, rectangle(512, 400, 700, 600));
  Builder facing;  // each in the other's silhouette
  facing.see(at({0, 0, -4}, 5), corners_of(unit_box)).see(at({0, 0, 4}, 4), corners_of(unit_box));
  all.push_back({"facing each other", facing.scene});
  facing.see(at({4, 0, 0}, 0), corners_of(unit_box)).see(at({-4, 0, 0}, 1), corners_of(unit_box));
  all.push_back({"two facing pairs", facing.scene});
}

void add_positions(std::vector<DegenerateScene>& all) {
  const auto box = corners_of(unit_box);
  Builder same;
  same.see(at({0, 0, -4}, 5), box)
      .see(at({0, 0, -4}, 5), corners_of({Vec3(-0.5, -1, -1), Vec3(1.5, 0.5, 1)}));
  same.see(at({4, 0, 0}, 0), box);
  all.push_back({"coincident centres", same.scene});
  Builder twice = three_axes();
  for (int i = 0; i < 3; ++i) twice.add(twice.scene.rig.cameras[i], twice.scene.silhouettes[i]);
  all.push_back({"every camera twice", twice.scene});
  Builder line;
  for (int i = 0; i < 4; ++i) line.see(at({-1.5 + i, 0, -4}, 5), box);
  all.push_back({"collinear centres, equal directions", line.scene});
  Builder depth;
  for (int i = 0; i < 3; ++i) depth.see(at({0, 0, -4.0 - i}, 5), box);
  all.push_back({"collinear along the view", depth.scene});
  Builder ring;
  ring.see(at({0, 0, -4}, 5), box)
      .see(at({0, 0, 4}, 4), box)
      .see(at({4, 0, 0}, 0), box)
      .see(at({-4, 0, 0}, 1), box);
  all.push_back({"coplanar, antipodal", ring.scene});
  Builder near;
  near.see(at({0, 0, -4}, 5), box).see(at({0x1p-20, 0, -4}, 5), box).see(at({4, 0, 0}, 0), box);
  all.push_back({"a millionth apart", near.scene});
  Builder in_cone;
  in_cone.see(at({0, 0, -4}, 5), box).see(at({0.25, 0.25, -2}, 5), box).see(at({0, -4, 0}, 3), box);
  all.push_back({"camera in another's cone", in_cone.scene});
  Builder in_hull;  // the third camera's centre is inside what the first two see
  in_hull.see(at({0, 0, -4}, 5), box).see(at({-4, 0, 0}, 1), box);
  in_hull.add(at({0, 0, 0}, 3), one(rectangle(200, 100, 800, 700)));
  all.push_back({"camera inside the hull", in_hull.scene});
  Builder parallel;
  parallel.see(at({-1, 0, -4}, 5), box).see(at({1, 0, -4}, 5), box).see(at({0, 1, -4}, 5), box);
  all.push_back({"parallel cameras", parallel.scene});
  Builder wide;
  for (const Vec3& c : {Vec3(0, 0, -4), Vec3(0.5, 0, -4)}) wide.see(at(c, 5, 1.0), box);
  wide.see(at({4, 0, 0}, 0, 1.0), box);
  all.push_back({"focal length of one pixel", wide.scene});
  Builder tele;
  const Bounds speck{Vec3(-0x1p-12), Vec3(0x1p-12)};
  tele.see(at({0, 0, -4}, 5, 1e6), corners_of(speck)).see(at({4, 0, 0}, 0, 1e6), corners_of(speck));
  tele.see(at({0, -4, 0}, 3, 1e6), corners_of(speck));
  all.push_back({"focal length of a million pixels", tele.scene});
  Builder mixed;
  mixed.see(at({0, 0, -4}, 5, 1.0), corners_of(speck))
      .see(at({4, 0, 0}, 0, 1e6), corners_of(speck));
  mixed.see(at({0, -4, 0}, 3, 1024), corners_of(unit_box));
  mixed.scene.silhouettes[0] = one(rectangle(511, 383, 513, 385));
  all.push_back({"focal lengths of one and a million pixels", mixed.scene});
  Builder oblique;  // a face from straight ahead to almost across, close behind its camera
  oblique.add(at({0, 0, -2.0625}, 5, 1.0), one({{512, 384}, {512, 700}, {1000, 384}}));
  oblique.see(at({0.5, 0, -4}, 5), corners_of(unit_box));
  all.push_back({"rays from straight ahead to across", oblique.scene});
}

void add_planes(std::vector<DegenerateScene>& all) {
  const auto box = corners_of(unit_box);
  all.push_back({"box on three axes", three_axes().scene});
  Builder eight;  // every camera's cone touches the box's eight corners
  for (int axis = 0; axis < 6; ++axis) {
    Vec3 centre(0.0);
    centre[axis / 2] = axis % 2 ? -4 : 4;
    eight.see(at(centre, axis), box);
  }
  all.push_back({"many planes through the corners of a box", eight.scene});
  Builder shared;  // bottom planes y = 1 of two cameras at y = 1: coplanar faces
  const Bounds low{Vec3(-1, -1, -1), Vec3(1, 0, 1)};
  shared.see(at({0, 0, -4}, 5), corners_of(low)).see(at({-4, 0, 0}, 1), corners_of(low));
  shared.see(at({4, 0, 0}, 0), corners_of(low)).see(at({0, -4, 0}, 3), box);
  all.push_back({"coplanar faces of several cameras", shared.scene});
  Builder flush = shared;
  flush.scene.rig.bounds = Bounds{Vec3(-2, -2, -2), Vec3(2, 0, 2)};
  all.push_back({"faces in the plane of the bounds", flush.scene});
  Builder graze;  // edges whose planes pass within a hair of another camera's
  graze.see(at({0, 0, -4}, 5), box);
  graze.see(at({0, 0x1p-30, -4}, 5), box).see(at({-4, 0x1p-30, 0}, 1), box);
  all.push_back({"grazing faces", graze.scene});
}

void add_rings(std::vector<DegenerateScene>& all) {
  Rings nested = one(rectangle(200, 100, 800, 700));
  add_ring(nested, turned(rectangle(300, 200, 700, 600)));
  add_ring(nested, rectangle(400, 300, 600, 500));
  add_ring(nested, turned(rectangle(450, 350, 550, 450)));
  all.push_back({"nested islands", with(nested)});
  all.push_back({"three hundred components", with(many_squares(20, 15, 8, 20))});
  all.push_back({"two thousand components", with(many_squares(50, 40, 8, 16))});
  HullScene grids = three_axes().scene;
  for (Rings& rings : grids.silhouettes) rings = many_squares(7, 7, 12, 40);
  all.push_back({"components in all cameras", grids});
  all.push_back({"one-pixel blobs", with(many_squares(5, 5, 1, 40))});
  Rings walls = one(rectangle(300, 200, 700, 600));
  add_ring(walls, turned(rectangle(301, 201, 500, 599)));
  add_ring(walls, turned(rectangle(501, 201, 699, 599)));
  all.push_back({"holes with one-pixel walls", with(walls)});
  all.push_back({"one-pixel wall", with(one(rectangle(512, 100, 513, 700)))});
  Rings border = one(rectangle(-0.5f, -0.5f, 1023.5f, 767.5f));
  all.push_back({"whole frame", with(border)});
  all.push_back({"touching the border", with(one(rectangle(-0.5f, 200, 600, 767.5f)))});
  Rings all_over = border;
  HullScene full = three_axes().scene;
  for (Rings& rings : full.silhouettes) rings = all_over;
  all.push_back({"whole frame in all cameras", full});
  all.push_back({"empty in one camera", with(Rings{})});
  HullScene none = three_axes().scene;
  for (Rings& rings : none.silhouettes) rings.clear();
  all.push_back({"empty in all cameras", none});
  std::vector<Vec2f> collinear;
  for (int i = 0; i < 40; ++i) collinear.emplace_back(300.0f, 200.0f + 10.0f * i);
  for (int i = 0; i < 40; ++i) collinear.emplace_back(300.0f + 10.0f * i, 600.0f);
  for (int i = 0; i < 40; ++i) collinear.emplace_back(700.0f, 600.0f - 10.0f * i);
  for (int i = 0; i < 40; ++i) collinear.emplace_back(700.0f - 10.0f * i, 200.0f);
  all.push_back({"collinear vertices", with(one(collinear))});
  std::vector<Vec2f> doubled;
  for (const Vec2f& p : rectangle(300, 200, 700, 600)) doubled.insert(doubled.end(), {p, p, p});
  all.push_back({"duplicate vertices", with(one(doubled))});
  all.push_back(
      {"spike", with(one({{300, 200}, {300, 600}, {100, 600}, {300, 600}, {700, 600}, {700, 200}})),
       false});
  all.push_back(
      {"ring of no area", with(one({{300, 200}, {500, 400}, {700, 600}, {500, 400}})), false});
  all.push_back({"ring of two vertices", with(one({{300, 200}, {700, 600}})), false});
  all.push_back({"ring of one vertex", with(one({{300, 200}})), false});
  all.push_back(
      {"self-touching at a vertex",
       with(one({{300, 200}, {300, 600}, {512, 400}, {700, 600}, {700, 200}, {512, 400}})), false});
  all.push_back(
      {"self-crossing", with(one({{300, 200}, {700, 600}, {700, 200}, {300, 600}})), false});
  all.push_back({"pentagram",
                 with(one({{512, 100}, {680, 620}, {240, 300}, {784, 300}, {344, 620}})), false});
  Rings touching = one(rectangle(300, 200, 500, 400));
  add_ring(touching, rectangle(500, 400, 700, 600));
  all.push_back({"two rings that share a vertex", with(touching), false});
  Rings beside = one(rectangle(300, 200, 500, 400));
  add_ring(beside, rectangle(500, 200, 700, 400));
  all.push_back({"two rings that share an edge", with(beside), false});
  Rings overlapping = one(rectangle(300, 200, 600, 500));
  add_ring(overlapping, rectangle(400, 300, 700, 600));
  all.push_back({"two rings that cross", with(overlapping), false});
  Rings same = one(rectangle(300, 200, 700, 600));
  add_ring(same, rectangle(300, 200, 700, 600));
  all.push_back({"the same ring twice", with(same), false});
  Rings hole_touches = one(rectangle(300, 200, 700, 600));
  add_ring(hole_touches, turned({{300, 400}, {400, 500}, {500, 400}, {400, 300}}));
  all.push_back({"hole that touches its ring", with(hole_touches), false});
}

void add_scales(std::vector<DegenerateScene>& all) {
  const HullScene figure = figure_scene(4, 24);
  const HullScene box = three_axes().scene;
  for (double scale : {1e-9, 1e-3, 1e3, 1e9}) {
    const std::string name =
        "scale 1e" + std::to_string(static_cast<int>(std::round(std::log10(scale))));
    all.push_back({name, moved(figure, scale, Vec3(0.0))});
    all.push_back({name + ", box", moved(box, scale, Vec3(0.0))});
  }
  all.push_back({"origin a million away", moved(figure, 1.0, Vec3(1e6, -2e6, 3e6))});
  all.push_back({"origin 1e9 away, figure", moved(figure, 1.0, Vec3(1e9, -7e8, 3e8))});
  all.push_back({"origin 1e9 away", moved(box, 1.0, Vec3(0x1p30, -0x1p30, 0x1p29))});
}

}  // namespace

Camera axis_camera(const std::string& name, const Vec3& centre, int axis, double focal) {
  Camera camera;
  camera.name = name;
  camera.width = 1024;
  camera.height = 768;
  camera.K = from_rows({focal, 0, 512, 0, focal, 384, 0, 0, 1});
  Vec3 forward(0.0), right(0.0);
  forward[axis / 2] = axis % 2 ? 1.0 : -1.0;
  right[(axis / 2 + 1) % 3] = 1.0;
  camera.R = glm::transpose(Mat3(right, glm::cross(forward, right), forward));
  camera.t = -(camera.R * centre);
  return camera;
}

std::vector<Vec3> corners_of(const Bounds& box) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                         i & 4 ? box.max.z : box.min.z);
  }
  return corners;
}

std::vector<Vec2f> outline_of(const std::vector<Vec3>& points, const Camera& camera) {
  std::vector<Vec2> pixels;
  for (const Vec3& X : points) {
    const Vec3 h = camera.K * (camera.R * X + camera.t);
    pixels.emplace_back(std::round(h.x / h.z * 16) / 16, std::round(h.y / h.z * 16) / 16);
  }
  std::sort(pixels.begin(), pixels.end(),
            [](Vec2 a, Vec2 b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
  const auto turn = [](Vec2 a, Vec2 b, Vec2 c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  std::vector<Vec2> hull;
  for (int pass = 0; pass < 2; ++pass) {  // Andrew's monotone chain
    const std::size_t start = hull.size();
    for (const Vec2& p : pixels) {
      while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(pixels.begin(), pixels.end());
  }
  std::vector<Vec2f> ring(hull.rbegin(), hull.rend());  // the chain runs clockwise on screen
  return ring;
}

std::vector<DegenerateScene> degenerate_scenes() {
  std::vector<DegenerateScene> all;
  add_epipoles(all);
  add_positions(all);
  add_planes(all);
  add_rings(all);
  add_scales(all);
  for (DegenerateScene& scene : all) scene.scene.name = scene.name;
  return all;
}

}  // namespace polyhull::test
