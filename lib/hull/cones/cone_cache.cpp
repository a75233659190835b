// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/cones/cone_cache.h"

#include <algorithm>
#include <cstring>

#include "base/thread_pool.h"

namespace polyhull::hull {
namespace {

template <class T>
int compare_bytes(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T));
}

/// An order of views by their content alone, so that the hull does not depend on how they arrived.
int compare_views(const ConeInput& a, const ConeInput& b) {
  if (int c = compare_bytes(a.camera->centre, b.camera->centre)) return c;
  if (int c = compare_bytes(a.camera->to_pixel, b.camera->to_pixel)) return c;
  const Rings &x = *a.silhouette->rings, &y = *b.silhouette->rings;
  if (x.points.size() != y.points.size()) return x.points.size() < y.points.size() ? -1 : 1;
  if (x.ends != y.ends) return x.ends < y.ends ? -1 : 1;
  if (x.points.empty()) return 0;  // no memory to compare: data() may be null
  return std::memcmp(x.points.data(), y.points.data(), x.points.size() * sizeof(Vec2f));
}

}  // namespace

void ConeCache::prepare(std::span<const Silhouette> views, std::span<const ConeCamera> cameras,
                        const Lattice& lattice, Unseen unseen, int threads,
                        std::vector<const Cone*>& used) {
  std::vector<ConeInput> inputs;
  for (std::size_t i = 0; i < views.size(); ++i)
    inputs.push_back({&views[i], &cameras[i], static_cast<std::int32_t>(i)});
  std::sort(inputs.begin(), inputs.end(), [](const ConeInput& a, const ConeInput& b) {
    const int c = compare_views(a, b);
    return c != 0 ? c < 0 : a.view < b.view;
  });
  // Views from one centre make one cone.
  std::vector<std::vector<ConeInput>> groups;
  std::vector<IntVec> centres;
  for (const ConeInput& input : inputs) {
    const IntVec centre = lattice_centre(*input.camera, lattice);
    std::size_t g = 0;
    while (g < groups.size() && centres[g] != centre) ++g;
    if (g == groups.size()) groups.emplace_back(), centres.push_back(centre);
    // The same view twice is the same cone.
    if (!groups[g].empty() && compare_views(groups[g].back(), input) == 0) continue;
    groups[g].push_back(input);
  }
  std::vector<std::unique_ptr<CachedCone>> old = std::move(cones_);
  cones_.clear();
  cones_.resize(groups.size());
  std::vector<std::size_t> missing;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto& group = groups[g];
    for (auto& candidate : old) {
      if (!candidate || candidate->lattice != lattice || candidate->unseen != unseen ||
          candidate->from.size() != group.size())
        continue;
      bool same = true;
      for (std::size_t i = 0; i < group.size() && same; ++i)
        same =
            candidate->views[i] == group[i].view && candidate->from[i].same(*group[i].silhouette);
      if (!same) continue;
      cones_[g] = std::move(candidate);
      break;
    }
    if (!cones_[g]) missing.push_back(g);
  }
  for (std::size_t g : missing) {
    for (auto& candidate : old)
      if (candidate) {
        cones_[g] = std::move(candidate);
        break;
      }
    if (!cones_[g]) cones_[g] = std::make_unique<CachedCone>();
    CachedCone& cached = *cones_[g];
    cached.lattice = lattice;
    cached.unseen = unseen;
    cached.from.resize(groups[g].size());
    cached.views.resize(groups[g].size());
    for (std::size_t i = 0; i < groups[g].size(); ++i) {
      cached.from[i].copy(*groups[g][i].silhouette);
      cached.views[i] = groups[g][i].view;
    }
  }
  try {
    parallel_each(missing.size(), 1, threads, [&](std::size_t i) {
      build_cone(cones_[missing[i]]->cone, groups[missing[i]], lattice, unseen);
    });
  } catch (...) {
    cones_.clear();
    throw;
  }
  used.clear();
  for (const auto& cached : cones_) used.push_back(&cached->cone);
}

}  // namespace polyhull::hull
