// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/rational_hull.h"

#include <gmpxx.h>

#include <algorithm>
#include <array>

namespace polyhull::test {
namespace {

using Number = mpq_class;
using Vector = std::array<Number, 3>;
using Plane =
    std::array<Number, 4>;  // inside where the product with (X, 1) is negative, or a view's edge

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct View {
  std::array<std::array<Number, 4>, 3> P;
  const Rings* rings;

  explicit View(const Silhouette& silhouette) : rings(silhouette.rings) {
    const Camera& camera = *silhouette.camera;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 4; ++j) {
        Number sum = 0;
        for (int k = 0; k < 3; ++k) {
          const double entry = j < 3 ? camera.R[j][k] : camera.t[k];
          sum += Number(camera.K[k][i]) * Number(entry);
        }
        P[i][j] = sum;
      }
    }
  }

  Vector see(const Vector& X) const {
    Vector h;
    for (int i = 0; i < 3; ++i) h[i] = P[i][0] * X[0] + P[i][1] * X[1] + P[i][2] * X[2] + P[i][3];
    return h;
  }

  Place place(const Vector& X) const {
    const Vector h = see(X);
    if (sgn(h[2]) <= 0) return Place::outside;
    bool in = false;
    for (std::size_t r = 0; r < rings->size(); ++r) {
      const auto ring = rings->ring(r);
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Vec2f p = ring[i], q = ring[i + 1 == ring.size() ? 0 : i + 1];
        const Number pu = h[0] - h[2] * p.x, pv = h[1] - h[2] * p.y;
        const Number qu = h[0] - h[2] * q.x, qv = h[1] - h[2] * q.y;
        const int side = sgn(pu * qv - pv * qu);
        if (side == 0 && sgn(pu * qu + pv * qv) <= 0) return Place::boundary;
        const bool below_p = sgn(pv) < 0, below_q = sgn(qv) < 0;
        if (below_p != below_q && (side > 0) == below_p) in = !in;
      }
    }
    return in ? Place::inside : Place::outside;
  }
};

struct Face {
  Plane plane;
  int view = -1;  // -1: bounds
  Vec2f p{0}, q{0};

  bool contains(const Vector& X, std::span<const View> views) const {  // X lies on the plane
    if (view < 0) return true;
    const Vector h = views[static_cast<std::size_t>(view)].see(X);
    if (sgn(h[2]) <= 0) return false;
    const Number pu = h[0] - h[2] * p.x, pv = h[1] - h[2] * p.y;
    const Number qu = h[0] - h[2] * q.x, qv = h[1] - h[2] * q.y;
    return sgn(pu * qu + pv * qv) <= 0;
  }
};

Place place_in(const Bounds& bounds, const Vector& X) {
  bool on = false;
  for (int k = 0; k < 3; ++k) {
    const int low = cmp(X[k], Number(bounds.min[k])), high = cmp(X[k], Number(bounds.max[k]));
    if (low < 0 || high > 0) return Place::outside;
    on |= low == 0 || high == 0;
  }
  return on ? Place::boundary : Place::inside;
}

std::vector<Face> faces_of(std::span<const View> views, const std::optional<Bounds>& bounds) {
  std::vector<Face> faces;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Rings& rings = *views[v].rings;
    for (std::size_t r = 0; r < rings.size(); ++r) {
      const auto ring = rings.ring(r);
      for (std::size_t i = 0; i < ring.size(); ++i) {
        Face face;
        face.view = static_cast<int>(v);
        face.p = ring[i];
        face.q = ring[i + 1 == ring.size() ? 0 : i + 1];
        const Vector line = cross({Number(face.p.x), Number(face.p.y), Number(1)},
                                  {Number(face.q.x), Number(face.q.y), Number(1)});
        for (int k = 0; k < 4; ++k) {
          face.plane[k] =
              line[0] * views[v].P[0][k] + line[1] * views[v].P[1][k] + line[2] * views[v].P[2][k];
        }
        faces.push_back(face);
      }
    }
  }
  for (int side = 0; bounds && side < 6; ++side) {
    Face face;
    face.plane = {0, 0, 0, Number(side % 2 ? -bounds->max[side / 2] : -bounds->min[side / 2])};
    face.plane[side / 2] = 1;
    faces.push_back(face);
  }
  return faces;
}

}  // namespace

Place rational_place(std::span<const Silhouette> silhouettes, const std::optional<Bounds>& bounds,
                     const Vec3& X) {
  const Vector x{Number(X.x), Number(X.y), Number(X.z)};
  Place place = bounds ? place_in(*bounds, x) : Place::inside;
  for (const Silhouette& silhouette : silhouettes)
    place = std::min(place, View(silhouette).place(x));
  return place;
}

RationalHull rational_hull(std::span<const Silhouette> silhouettes,
                           const std::optional<Bounds>& bounds) {
  std::vector<View> views(silhouettes.begin(), silhouettes.end());
  const std::vector<Face> faces = faces_of(views, bounds);
  RationalHull result;
  std::vector<Vector> found;
  for (std::size_t a = 0; a < faces.size(); ++a) {
    for (std::size_t b = a + 1; b < faces.size(); ++b) {
      const auto& p = faces[a].plane;
      const auto& q = faces[b].plane;
      const Vector pq = cross({p[0], p[1], p[2]}, {q[0], q[1], q[2]});
      for (std::size_t c = b + 1; c < faces.size(); ++c) {
        const std::array<const Face*, 3> three{&faces[a], &faces[b], &faces[c]};
        const auto& r = faces[c].plane;
        const Number det = pq[0] * r[0] + pq[1] * r[1] + pq[2] * r[2];
        if (sgn(det) == 0) continue;
        // X = -(p.w (q x r) + q.w (r x p) + r.w (p x q)) / det
        const Vector qr = cross({q[0], q[1], q[2]}, {r[0], r[1], r[2]});
        const Vector rp = cross({r[0], r[1], r[2]}, {p[0], p[1], p[2]});
        Vector X;
        for (int k = 0; k < 3; ++k) X[k] = -(p[3] * qr[k] + q[3] * rp[k] + r[3] * pq[k]) / det;
        bool on_all = true;
        for (const Face* face : three) on_all = on_all && face->contains(X, views);
        if (!on_all) continue;
        // The planes' own views are decided by the segments above; the others must be strictly
        // inside.
        Place place = Place::inside;
        for (std::size_t v = 0; v < views.size(); ++v) {
          const bool own = std::any_of(three.begin(), three.end(), [&](const Face* face) {
            return face->view == static_cast<int>(v);
          });
          if (!own) place = std::min(place, views[v].place(X));
        }
        if (bounds) {
          const bool own = std::any_of(three.begin(), three.end(),
                                       [](const Face* face) { return face->view < 0; });
          const Place in_box = place_in(*bounds, X);
          if (!own || in_box == Place::outside) place = std::min(place, in_box);
        }
        if (place == Place::outside) continue;
        if (place == Place::boundary || std::find(found.begin(), found.end(), X) != found.end()) {
          result.general_position = false;
          continue;
        }
        found.push_back(X);
        result.vertices.emplace_back(X[0].get_d(), X[1].get_d(), X[2].get_d());
      }
    }
  }
  return result;
}

}  // namespace polyhull::test
