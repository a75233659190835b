// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "base/picture.h"
#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "studio/figure/polygons/polygonise.h"
#include "support/folder.h"

namespace polyhull {
namespace {

double volume(const std::vector<Vec3f>& positions, const std::vector<std::uint32_t>& triangles) {
  double sum = 0.0;
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    sum += glm::dot(Vec3(positions[triangles[t]]), glm::cross(Vec3(positions[triangles[t + 1]]),
                                                              Vec3(positions[triangles[t + 2]])));
  }
  return sum / 6.0;
}

TEST(Polygonise, SphereIsClosedAndOnTheLevel) {
  const auto value = [](const Vec3f& p) { return glm::length(p) - 0.7f; };
  TriangleMesh mesh = polygonise(value, Vec3f(-1.0f), Vec3f(1.0f), 0.05f);
  EXPECT_TRUE(manifold_defects(mesh.triangles, mesh.vertices.size()).none());
  EXPECT_NEAR(volume(mesh.vertices, mesh.triangles), 4.0 / 3.0 * M_PI * 0.343, 0.01);
  relax(
      mesh, value, [](const Vec3f& p) { return glm::normalize(p); }, 4);
  for (const Vec3f& v : mesh.vertices) EXPECT_NEAR(glm::length(v), 0.7f, 1e-5f);
  EXPECT_THROW(polygonise(value, Vec3f(-0.5f), Vec3f(1.0f), 0.05f), Error);
}

TEST(Polygonise, DefectsAreFound) {
  const std::vector<std::uint32_t> tetrahedron = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  EXPECT_TRUE(manifold_defects(tetrahedron, 4).none());
  EXPECT_EQ(manifold_defects({0, 2, 1, 0, 1, 3, 1, 2, 3}, 4).open_edges, 3u);
  std::vector<std::uint32_t> two = tetrahedron;  // a second one that shares vertex 0
  for (const std::uint32_t v : tetrahedron) two.push_back(v == 0 ? 0 : v + 3);
  EXPECT_EQ(manifold_defects(two, 7).pinched_vertices, 1u);
  std::vector<std::uint32_t> turned = tetrahedron;
  std::swap(turned[0], turned[1]);
  EXPECT_GT(manifold_defects(turned, 4).crowded_edges, 0u);
  EXPECT_EQ(manifold_defects({0, 0, 1}, 2).empty_triangles, 1u);
}

TEST(Figure, ClosedManifoldOfHumanSize) {
  const auto figure = open_subject("figure");
  EXPECT_TRUE(manifold_defects(figure->triangles(), figure->vertex_count()).none());
  SubjectFrame frame;
  for (int i = 0; i < 100; ++i) {
    figure->pose(0.1 * i + 0.03, frame);
    ASSERT_EQ(frame.positions.size(), figure->vertex_count());
    Vec3f min(1e9f), max(-1e9f);
    for (std::size_t k = 0; k < frame.positions.size(); ++k) {
      const Vec3f& p = frame.positions[k];
      ASSERT_TRUE(std::isfinite(p.x + p.y + p.z)) << i;
      ASSERT_NEAR(glm::length(frame.normals[k]), 1.0f, 1e-3f);
      min = glm::min(min, p);
      max = glm::max(max, p);
    }
    // On the floor, neither hovering nor sunk, and inside the built-in rig's bounds.
    EXPECT_NEAR(min.y, 0.0f, 0.015f) << "at " << 0.1 * i;
    EXPECT_GT(max.y, 1.70f);
    EXPECT_LT(max.y, 2.25f);
    EXPECT_GT(std::min(min.x, min.z), -1.15f);
    EXPECT_LT(std::max(max.x, max.z), 1.15f);
    const double litres = 1000.0 * volume(frame.positions, figure->triangles());
    EXPECT_GT(litres, 45.0);
    EXPECT_LT(litres, 80.0);
  }
}

/// Outlines stay in place when large triangles reach out of the surface at their corners and into
/// it between them; so a little of the volume is lost.
TEST(Figure, CoarserOnesAreClosedAndOfTheSameSize) {
  const auto figure = open_subject("figure");
  EXPECT_EQ(figure->coarser(0.5f * coarser_skins.front().pixel), nullptr);
  for (const CoarserSkin& skin : coarser_skins) {
    const auto coarser = figure->coarser(skin.pixel);
    ASSERT_TRUE(coarser);
    EXPECT_LE(coarser->triangles().size() / 3, skin.triangles);
    EXPECT_GT(coarser->triangles().size() / 3, skin.triangles - 10);
    EXPECT_TRUE(manifold_defects(coarser->triangles(), coarser->vertex_count()).none());
    for (const double time : {0.0, 3.3, 6.9}) {
      SubjectFrame fine, coarse;
      figure->pose(time, fine);
      coarser->pose(time, coarse);
      const double litres = 1000.0 * volume(fine.positions, figure->triangles());
      EXPECT_NEAR(1000.0 * volume(coarse.positions, coarser->triangles()), litres, 0.01 * litres)
          << skin.triangles << " at " << time;
    }
  }
}

TEST(Figure, NoTriangleIsTurnedInsideOutOrStretchedAtRest) {
  const auto figure = std::dynamic_pointer_cast<const Figure>(open_subject(""));
  ASSERT_TRUE(figure);
  const auto bodies = figure_bodies();
  std::size_t slivers = 0;
  for (std::size_t t = 0; t < figure->triangles().size(); t += 3) {
    const Vec3f &a = figure->rest_positions()[figure->triangles()[t]],
                &b = figure->rest_positions()[figure->triangles()[t + 1]],
                &c = figure->rest_positions()[figure->triangles()[t + 2]];
    const Vec3f n = glm::cross(b - a, c - a);
    const float longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    EXPECT_LT(longest, 0.05f);
    slivers += glm::length(n) < 0.02f * longest * longest;
  }
  EXPECT_LT(slivers, figure->triangles().size() / 3 / 200);
  for (const Vec3f& p : figure->rest_positions()) EXPECT_NEAR(skin_value(bodies, p), 0.0f, 2e-3f);
}

TEST(Figure, MovesSmoothlyAndRepeats) {
  const auto figure = open_subject("figure");
  SubjectFrame a, b;
  figure->pose(1.234, a);
  figure->pose(1.234 + motion_period, b);
  for (std::size_t i = 0; i < a.positions.size(); ++i) {
    ASSERT_LT(glm::distance(a.positions[i], b.positions[i]), 1e-4f);
  }
  float largest = 0.0f, total = 0.0f;
  constexpr double step = 0.02;
  for (double t = 0.0; t < motion_period; t += step) {
    figure->pose(t, a);
    figure->pose(t + step, b);
    float most = 0.0f;
    for (std::size_t i = 0; i < a.positions.size(); i += 7) {
      most = std::max(most, glm::distance(a.positions[i], b.positions[i]));
    }
    largest = std::max(largest, most);
    total += most;
  }
  EXPECT_LT(largest / step, 7.0) << "metres per second: something jumps";
  EXPECT_GT(total, 5.0f) << "nothing moves";
}

TEST(Figure, StandingFeetDoNotSlide) {
  // While a foot carries, the lowest points of the shoe rest.
  const auto figure = std::dynamic_pointer_cast<const Figure>(open_subject("figure"));
  std::vector<std::size_t> soles;
  for (std::size_t i = 0; i < figure->rest_positions().size(); ++i) {
    const Vec3f& p = figure->rest_positions()[i];
    if (p.y < 0.004f && p.z > 0.09f && p.z < 0.14f && p.x > 0) soles.push_back(i);
  }
  ASSERT_GT(soles.size(), 10u);
  SubjectFrame a, b;
  figure->pose(3.05, a);  // the left foot came down at 3.0
  figure->pose(3.40, b);
  for (const std::size_t i : soles) EXPECT_LT(glm::distance(a.positions[i], b.positions[i]), 0.01f);
}

TEST(Figure, SameOnOneThreadAndMany) {
  set_pool_threads(1);
  const Figure one(make_figure_skin(0.03f));
  SubjectFrame a, b;
  one.pose(2.5, a);
  set_pool_threads(4);
  const Figure many(make_figure_skin(0.03f));
  many.pose(2.5, b);
  set_pool_threads(0);
  EXPECT_EQ(one.triangles(), many.triangles());
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.normals, b.normals);
}

TEST(Figure, ColoursAreNeitherGreenNorBlue) {
  const auto figure = open_subject("figure");
  const TruthMesh mesh = truth_mesh(*figure, default_rig(), 0.0);
  for (const Vec3f& c : mesh.colours) {
    EXPECT_LT(c.y, std::max(c.x, c.z) + 0.02f);
    EXPECT_LT(c.z, std::max(c.x, c.y) + 0.03f);
  }
}

TEST(FileSubject, ReadsRealMeshes) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::string path = std::string(data ? data : "") + "/meshes/spot.obj";
  if (!std::ifstream(path)) GTEST_SKIP() << path << " is missing.";
  const auto spot = open_subject(path, 1.5);
  EXPECT_EQ(spot->warning(), "");
  EXPECT_EQ(spot->vertex_count(), 2930u);
  SubjectFrame frame;
  spot->pose(0.0, frame);
  float low = 1e9f, high = -1e9f;
  for (const Vec3f& p : frame.positions) {
    low = std::min(low, p.y);
    high = std::max(high, p.y);
  }
  EXPECT_NEAR(low, 0.0f, 1e-5f);
  EXPECT_NEAR(high, 1.5f, 1e-4f);
}

TEST(FileSubject, RefusesWhatIsNoSubject) {
  const test::Folder folder;
  const auto file = [&](const char* name, const char* text) {
    std::ofstream(folder / name) << text;
    return folder.file(name);
  };
  EXPECT_THROW(open_subject(folder.file("none.obj")), Error);
  EXPECT_THROW(open_subject(file("empty.obj", "")), Error);
  EXPECT_THROW(open_subject(file("points.obj", "v 0 0 0\nv 1 0 0\n")), Error);
  EXPECT_THROW(open_subject(file("outside.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")), Error);
  EXPECT_THROW(open_subject(file("text.obj", "this is a letter, not a mesh\n")), Error);
  const auto open = open_subject(file("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  EXPECT_NE(open->warning().find("3 open edges"), std::string::npos) << open->warning();
}

TEST(FileSubject, FindsPicturesByTheNamesOfOtherSystems) {
  const test::Folder folder;
  std::filesystem::create_directories(folder / "textures");
  save_picture({1, 1, 3, {255, 0, 0}}, (folder / "textures" / "skin.png").string());
  save_picture({1, 1, 3, {0, 0, 255}}, folder.file("beside.png"));
  std::ofstream(folder / "a.obj") << "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
                                     "usemtl m\nf 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\n"
                                     "f 2/1 3/1 4/1\n";
  const auto colour = [&](const std::string& name) {
    std::ofstream(folder / "a.mtl") << "newmtl m\nKd 0 1 0\nmap_Kd " << name << "\n";
    const auto subject = open_subject(folder.file("a.obj"));
    return std::pair(subject->albedo(0, Vec3f(1, 0, 0), 0.01f), subject->warning());
  };
  const Vec3f red(1, 0, 0), blue(0, 0, 1);
  for (const char* name : {"textures/skin.png", "textures\\skin.png"})
    EXPECT_EQ(colour(name), std::pair(red, std::string())) << name;
  for (const char* name : {"C:\\Users\\me\\beside.png", "/home/me/beside.png", "beside.png"})
    EXPECT_EQ(colour(name), std::pair(blue, std::string())) << name;
  EXPECT_NE(colour("nowhere.png").second.find("nowhere.png"), std::string::npos);
}

TEST(FileSubject, SaysWhichColoursAreMissing) {
  const test::Folder folder;
  save_picture({1, 1, 3, {255, 0, 0}}, folder.file("skin.png"));
  const auto open = [&](const std::string& mtl, const std::string& faces) {
    std::ofstream(folder / "a.obj")
        << "mtllib " << mtl << "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nusemtl m\n"
        << faces;
    return open_subject(folder.file("a.obj"));
  };
  std::ofstream(folder / "a.mtl") << "newmtl m\nKd 0 1 0\nmap_Kd skin.png\n";
  std::ofstream(folder / "b.mtl") << "newmtl m\nmap_Kd nowhere.png\n";
  // A face without texture coordinates takes nobody else's texture away.
  const std::string closed = "f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1 4 3\nf 2 3 4\n";
  const auto mixed = open("a.mtl", closed);
  EXPECT_EQ(mixed->warning(), "");
  EXPECT_EQ(mixed->albedo(0, Vec3f(1, 0, 0), 0.01f), Vec3f(1, 0, 0));
  EXPECT_EQ(mixed->albedo(2, Vec3f(1, 0, 0), 0.01f), Vec3f(0, 1, 0));
  // Another warning, by the name of a material, is none of colours.
  std::ofstream(folder / "d.mtl") << "newmtl Material\nKd 0 1 0\nd 1\nTr 0\nnewmtl m\nKd 0 1 0\n";
  EXPECT_EQ(open("d.mtl", closed)->warning(), "");
  // Each fault is said, also where there are two.
  const std::string none = open("c.mtl", closed)->warning();
  EXPECT_NE(none.find("c.mtl"), std::string::npos) << none;
  const std::string two = open("b.mtl", "f 1/1 3/1 2/1\n")->warning();
  EXPECT_NE(two.find("nowhere.png"), std::string::npos) << two;
  EXPECT_NE(two.find("open edges"), std::string::npos) << two;
}

TEST(TruthMesh, ReadsBackAndNamesWhatFails) {
  const auto figure = open_subject("figure");
  const TruthMesh mesh = truth_mesh(*figure, default_rig(), 6.5);
  const test::Folder folder;
  const std::string path = folder.file("truth.obj");
  write_truth_mesh(mesh, path);
  const auto again = open_subject(path);
  EXPECT_EQ(again->warning(), "");
  EXPECT_EQ(again->vertex_count(), mesh.positions.size());
  EXPECT_EQ(again->triangles(), mesh.triangles);
  EXPECT_THROW(write_truth_mesh(mesh, "/nowhere/at/all.ply"), Error);
  EXPECT_THROW(write_truth_mesh(mesh, "/tmp/mesh.xyz"), Error);
}

TEST(Placement, FollowsTheRig) {
  Rig rig = default_rig();
  EXPECT_EQ(placement_for(rig)(Vec3(1, 2, 3)), Vec3(1, 2, 3));
  rig.unit = "mm";
  rig.up = Vec3(0, 0, 1);
  rig.bounds.reset();
  const Vec3 head = placement_for(rig)(Vec3(0, 1.75, 0));
  EXPECT_NEAR(glm::distance(head, Vec3(0, 0, 1750)), 0.0, 1e-9);
  rig.bounds = Bounds{Vec3(100, 100, 0), Vec3(300, 500, 2000)};
  const Vec3 feet = placement_for(rig)(Vec3(0, 0, 0));
  EXPECT_NEAR(glm::distance(feet, Vec3(200, 300, 0)), 0.0, 1e-9);
  rig.up = Vec3(0, -1, 0);
  EXPECT_NEAR(glm::determinant(placement_for(rig).linear), 1e9, 1e-3);
}

}  // namespace
}  // namespace polyhull
