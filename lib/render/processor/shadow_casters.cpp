// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/shadow_casters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace polyhull::processor {
namespace {

/// Adds triangles that cover the convex hull of \p points from wherever one looks: those of the first
/// point and each pair of others.
void add_convex(std::span<const Vec3f> points, SubjectsShape& shape) {
  const auto base = static_cast<std::uint32_t>(shape.points.size());
  const auto count = static_cast<std::uint32_t>(points.size());
  shape.points.insert(shape.points.end(), points.begin(), points.end());
  for (std::uint32_t i = 1; i < count; ++i)
    for (std::uint32_t j = i + 1; j < count; ++j)
      for (const std::uint32_t corner : {0u, i, j}) shape.triangles.push_back(base + corner);
}

/// The chains for the first \p count of \p ways.
void gather_around(const ImageHull& hull, const ImageHull::Origin& origin,
                   const ImageHull::Directions& ways, std::size_t count,
                   ImageHull::Bundle& bundle) {
  const auto way = [&](std::size_t i) { return Vec3f(ways.x[i], ways.y[i], ways.z[i]); };
  Vec3f axis(0.0f);
  for (std::size_t i = 0; i < count; ++i) axis += glm::normalize(way(i));
  axis = glm::normalize(axis);
  const Vec3f side =
      glm::normalize(glm::cross(axis, std::abs(axis.y) < 0.9f ? Vec3f(0, 1, 0) : Vec3f(1, 0, 0)));
  const Vec3f up = glm::cross(axis, side);
  Vec2f low(INFINITY), high(-INFINITY);
  for (std::size_t i = 0; i < count; ++i) {
    const float depth = glm::dot(way(i), axis);
    if (!(depth > 0.1f * glm::length(way(i)))) {
      bundle = hull.all();
      return;
    }
    const Vec2f tangents(glm::dot(way(i), side) / depth, glm::dot(way(i), up) / depth);
    low = glm::min(low, tangents);
    high = glm::max(high, tangents);
  }
  const Vec2f margin = 1e-5f * (1.0f + glm::max(glm::abs(low), glm::abs(high)));
  low -= margin;
  high += margin;
  hull.gather(origin,
              {axis + low.x * side + low.y * up, axis + high.x * side + low.y * up,
               axis + low.x * side + high.y * up, axis + high.x * side + high.y * up},
              bundle);
}

}  // namespace

void SolidSubjects::forget() {
  made_ = false;
}

void SolidSubjects::make(const RenderPlan& plan) {
  const std::lock_guard lock(making_);
  if (made_) return;
  if (mesh_) caster_.remove_mesh(*mesh_);
  mesh_.reset();
  const SubjectsShape shape = shape_of(plan);
  any_ = !shape.triangles.empty();
  mesh_ = caster_.add_mesh(shape.points, shape.triangles);
  caster_.commit();
  made_ = true;
}

void SolidSubjects::occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked) const {
  if (any_)
    caster_.occluded(rays, blocked);
  else
    std::fill(blocked.begin(), blocked.end(), std::uint8_t{0});
}

void ShadowCasters::set(const RenderPlan& plan, SolidSubjects& solid, const Light& light,
                        const ShadowRecipe& recipe, bool same) {
  if (same) return;
  solid_ = &solid;
  places_.clear();
  SubjectsShape shape = shape_of(plan);
  images_.clear();
  for (const PlacedSubject& subject : plan.subjects) {
    if (!subject.image) continue;
    images_.push_back({subject.image, subject.from_scene});
    add_convex(subject.points, shape);
  }
  if (reach_.build(light, shape.points, shape.triangles)) ++map_;
  masked_ = images_.empty() && recipe.masked;
  masks_.resize(plan.subjects.size());
  for (std::size_t i = 0; masked_ && i < masks_.size(); ++i)
    masked_ = masks_[i].set(reach_, plan.subjects[i].points, plan.subjects[i].mesh->hull.triangles,
                            recipe.mask_texels);
  if (!masked_) solid.make(plan);
}

void ShadowCasters::aim(std::span<const Vec3f> places) {
  if (std::equal(places.begin(), places.end(), places_.begin(), places_.end())) return;
  places_.assign(places.begin(), places.end());
  for (LightMasks& masks : masks_)
    if (masked_) masks.aim(places);
  origins_.clear();
  for (const Image& image : images_)
    for (const Vec3f& place : places)
      origins_.push_back(image.subject->hull.from(Vec3(image.from_scene * Vec4(Vec3(place), 1.0))));
}

void ShadowCasters::find_hidden(std::size_t first, int count, const MaskPoints& receivers,
                                std::uint32_t* hidden) const {
  for (const LightMasks& masks : masks_) masks.find_hidden(first, count, receivers, hidden);
}

void ShadowCasters::occluded(std::span<const Ray> rays, std::size_t number,
                             std::span<std::uint8_t> blocked) const {
  solid_->occluded(rays, blocked.first(rays.size()));
  thread_local ImageHull::Scratch scratch;
  thread_local ImageHull::Bundle bundle;
  for (std::size_t i = 0; i < images_.size(); ++i) {
    const ImageHull& hull = images_[i].subject->hull;
    const glm::mat3 turn(Mat3(images_[i].from_scene));
    const ImageHull::Origin& origin = origins_[i * places_.size() + number];
    // From the light, whose points are few: s = 1 is where the ray begins.
    ImageHull::Directions ways;
    float near[ImageHull::lanes];
    for (std::size_t k = 0; k < ImageHull::lanes; ++k) {
      const Vec3f way = turn * (rays[std::min(k, rays.size() - 1)].origin - places_[number]);
      ways.x[k] = way.x;
      ways.y[k] = way.y;
      ways.z[k] = way.z;
      near[k] = std::numeric_limits<float>::infinity();
    }
    gather_around(hull, origin, ways, rays.size(), bundle);
    if (bundle.empty) continue;
    ImageHull::Hits hits;
    hull.enter(origin, bundle, ways, near, scratch, hits);
    for (std::size_t k = 0; k < rays.size(); ++k) blocked[k] |= hits.inverse[k] > 1.0f;
  }
}

}  // namespace polyhull::processor
