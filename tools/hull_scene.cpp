// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull_scene.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>

#include "base/error.h"
#include "base/parse_json.h"
#include "base/plain_text.h"
#include "base/whole_file.h"

namespace polyhull {
namespace {

using Json = nlohmann::json;

Rings parse_rings(const Json& json, const std::string& where) {
  const auto fail = [&](const std::string& what) {
    throw Error(Error::Kind::bad_input, "{}: {}; expected [ring][vertex][u, v].", where, what);
  };
  Rings rings;
  if (!json.is_array()) fail("the silhouette is not an array");
  for (const Json& ring : json) {
    if (!ring.is_array()) fail("a ring is not an array");
    for (const Json& point : ring) {
      if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number())
        fail("a vertex is not a pair of numbers");
      const Vec2f p(point[0].get<float>(), point[1].get<float>());
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) fail("a vertex is not finite");
      rings.points.push_back(p);
    }
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
  }
  orient_rings(rings);
  return rings;
}

}  // namespace

std::vector<Silhouette> HullScene::views() const {
  std::vector<Silhouette> views;
  for (std::size_t i = 0; i < silhouettes.size(); ++i)
    views.push_back({&rig.cameras[i], &silhouettes[i]});
  return views;
}

std::size_t HullScene::contour_vertices() const {
  std::size_t count = 0;
  for (const Rings& rings : silhouettes) count += rings.points.size();
  return count;
}

void orient_rings(Rings& rings) {
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const auto ring = rings.ring(i);
    if (ring.empty()) continue;
    double area = 0.0;  // positive: clockwise on screen, where y points down
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2 a(ring[k]), b(ring[k + 1 == ring.size() ? 0 : k + 1]);
      area += cross(a, b);
    }
    bool hole = false;
    for (std::size_t other = 0; other < rings.size(); ++other)
      if (other != i && is_inside(rings.ring(other), Vec2(ring[0]))) hole = !hole;
    if ((area > 0.0) != hole) {
      const std::size_t begin = i == 0 ? 0 : rings.ends[i - 1];
      std::reverse(rings.points.begin() + static_cast<std::ptrdiff_t>(begin),
                   rings.points.begin() + rings.ends[i]);
    }
  }
}

HullScene parse_hull_scene(std::string_view text, const std::string& source) {
  try {
    const auto json = parse_json<Json>(text, source);
    HullScene scene;
    scene.name = json.value("name", source);
    scene.rig = parse_rig(json.at("rig").dump(), source);
    const Json& silhouettes = json.at("silhouettes");
    if (silhouettes.size() != scene.rig.cameras.size()) {
      throw Error(Error::Kind::bad_input,
                  "{}: {} silhouettes for {} cameras; expected one for each.", source,
                  silhouettes.size(), scene.rig.cameras.size());
    }
    for (std::size_t i = 0; i < silhouettes.size(); ++i) {
      const std::string where = source + ", silhouette of camera " + scene.rig.cameras[i].name;
      scene.silhouettes.push_back(parse_rings(silhouettes[i], where));
    }
    if (const auto reference = json.find("reference");
        reference != json.end() && reference->contains("volume"))
      scene.reference_volume = reference->at("volume").get<double>();
    return scene;
  } catch (const Json::exception& error) {
    throw Error(Error::Kind::bad_input, "{}: not a hull scene: {}.", source, error.what());
  }
}

HullScene load_hull_scene(const std::string& path) {
  std::optional<std::string> text = whole_file(path);
  if (!text)
    throw Error(Error::Kind::not_found,
                "{}: cannot open the scene file; check that it exists and may be read.", path);
  return parse_hull_scene(plain_text(*std::move(text), path), path);
}

std::string hull_scene_to_json(const HullScene& scene) {
  Json json;
  json["name"] = scene.name;
  json["rig"] = Json::parse(rig_to_json(scene.rig));
  Json& silhouettes = json["silhouettes"] = Json::array();
  for (const Rings& rings : scene.silhouettes) {
    Json camera = Json::array();
    for (std::size_t r = 0; r < rings.size(); ++r) {
      Json ring = Json::array();
      for (const Vec2f& p : rings.ring(r)) ring.push_back({double(p.x), double(p.y)});
      camera.push_back(std::move(ring));
    }
    silhouettes.push_back(std::move(camera));
  }
  if (scene.reference_volume) json["reference"]["volume"] = *scene.reference_volume;
  return json.dump();
}

}  // namespace polyhull
