// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/camera_picture.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

std::uint8_t byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value * 255.0f + 0.5f, 0.0f, 255.0f));
}

}  // namespace

CameraPicture::CameraPicture(const Rig& rig, int index, std::shared_ptr<const Subject> subject)
    : index_(index),
      placement_(placement_for(rig)),
      metres_per_unit_(rig.metres_per_unit()),
      subject_(std::move(subject)) {
  if (index < 0 || index >= static_cast<int>(rig.cameras.size())) {
    throw Error(Error::Kind::bad_input,
                "Camera number {} was asked for, but the rig has {} cameras, counted from 0.",
                index, rig.cameras.size());
  }
  camera_ = rig.cameras[index];
  eye_ = Vec3f(glm::inverse(placement_.linear) * (camera_.centre() - placement_.origin));
  pixel_size_ = static_cast<float>(2.0 * metres_per_unit_ /
                                   (std::abs(camera_.K[0][0]) + std::abs(camera_.K[1][1])));
}

void CameraPicture::set_time(double seconds) {
  if (posed_ && seconds == time_) return;
  subject_->pose(seconds, surface_);
  time_ = seconds;
  posed_ = true;
  shadow_cast_ = false;
}

CoverageRaster::Mesh CameraPicture::mesh() const {
  CoverageRaster::Mesh mesh;
  mesh.positions = surface_.positions;
  mesh.triangles = subject_->triangles();
  mesh.linear = placement_.linear;
  mesh.origin = placement_.origin;
  mesh.separation = static_cast<float>(0.02 / metres_per_unit_);
  return mesh;
}

Vec3f CameraPicture::shade(const PictureLook& look, const Vec3f& screen_light,
                           const Fragment& f) const {
  const std::uint32_t* v = &subject_->triangles()[3 * static_cast<std::size_t>(f.triangle)];
  const auto mix = [&](const std::vector<Vec3f>& values) {
    return values[v[0]] * f.at.x + values[v[1]] * f.at.y + values[v[2]] * f.at.z;
  };
  const Vec3f sum = mix(surface_.normals);
  const float length = glm::length(sum);
  const Vec3f normal = length > 0.0f ? sum / length : Vec3f(0, 1, 0);
  const Vec3f to_eye = glm::normalize(eye_ - mix(surface_.positions));
  const float facing = std::max(glm::dot(normal, to_eye), 0.0f);
  // A pixel sees the more of a surface, the more that is turned away.
  const float width = f.depth * pixel_size_ / std::max(facing, 0.35f);
  const Vec3f albedo = subject_->albedo(f.triangle, f.at, width);
  Vec3f light = albedo * studio_light(normal);
  if (look.spill > 0.0) {
    // From the floor and the walls around, and by reflection at grazing angles.
    const float graze = (1.0f - facing) * (1.0f - facing);
    const float around = 0.35f - 0.15f * normal.y;
    light +=
        screen_light * static_cast<float>(look.spill) * (albedo * around + Vec3f(0.35f * graze));
  }
  return light;
}

void CameraPicture::picture(const PictureLook& look, std::uint64_t frame, bool matte_in_alpha,
                            std::uint8_t* pixels, std::ptrdiff_t stride) {
  if (!screen_ready_ || !(look.screen == screen_look_)) {
    screen_.prepare(camera_, look.screen, index_);
    screen_look_ = look.screen;
    screen_ready_ = true;
  }
  const bool shadow = look.shadow > 0.0;
  if (shadow && !screen_.has_floor()) screen_.find_floor(camera_, placement_);
  if (shadow && !shadow_cast_) {
    shadow_.cast(surface_, subject_->triangles());
    shadow_cast_ = true;
  }
  noise_.prepare(look.noise);
  const auto& green = look.screen.colour;
  const Vec3f screen_light = srgb_decoded(Vec3f(green[0], green[1], green[2]) / 255.0f);
  const auto row = [&](int y) { return pixels + y * stride; };
  parallel_for(camera_.height, 32, 0, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      std::memcpy(row(y), screen_.row(y), 4 * static_cast<std::size_t>(camera_.width));
      if (matte_in_alpha)
        for (int x = 0; x < camera_.width; ++x) row(y)[4 * x + 3] = 0;
      if (shadow && y >= screen_.first_shadow_row() && y <= screen_.last_shadow_row())
        screen_.add_shadow(shadow_, look.shadow, y, row(y));
    }
  });
  region_ = raster_.draw(camera_, mesh(), [&](int y, std::span<const CoveredPixel> covered) {
    for (const CoveredPixel& pixel : covered) {
      std::uint8_t* out = row(y) + 4 * static_cast<std::size_t>(pixel.x);
      Vec3f light(0.0f), code(0.0f);
      for (int i = 0; i < pixel.fragment_count; ++i) {
        const Fragment& f = pixel.fragments[i];
        const Vec3f colour = shade(look, screen_light, f);
        light += colour * f.weight;
        if (!look.linear_light) {
          code += Vec3f(srgb_from_linear(colour.x), srgb_from_linear(colour.y),
                        srgb_from_linear(colour.z)) *
                  f.weight;
        }
      }
      for (int c = 0; c < 3; ++c) {
        const float behind = static_cast<float>(out[c]) / 255.0f;
        if (look.linear_light) {
          const float mixed =
              srgb_decoded(behind) * (1.0f - pixel.coverage) + light[c] * pixel.coverage;
          out[c] = byte(srgb_from_linear(mixed));
        } else {
          out[c] = byte(behind * (1.0f - pixel.coverage) + code[c] * pixel.coverage);
        }
      }
      if (matte_in_alpha) out[3] = byte(pixel.coverage);
    }
  });
  if (look.noise <= 0.0) return;
  const std::uint64_t key =
      mix_bits(mix_bits(mix_bits(look.seed) + frame) + static_cast<std::uint64_t>(index_));
  parallel_for(camera_.height, 32, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      noise_.add(look.noise, mix_bits(key + y), row(static_cast<int>(y)), camera_.width);
    }
  });
}

void CameraPicture::matte(std::uint8_t* pixels, std::ptrdiff_t stride) {
  for (int y = 0; y < camera_.height; ++y) std::memset(pixels + y * stride, 0, camera_.width);
  region_ = raster_.draw(camera_, mesh(), [&](int y, std::span<const CoveredPixel> covered) {
    for (const CoveredPixel& pixel : covered) pixels[y * stride + pixel.x] = byte(pixel.coverage);
  });
}

void CameraPicture::depth(float* values) {
  std::fill(values, values + static_cast<std::size_t>(camera_.width) * camera_.height, 0.0f);
  region_ = raster_.draw(camera_, mesh(), [&](int y, std::span<const CoveredPixel> covered) {
    float* row = values + static_cast<std::size_t>(y) * camera_.width;
    for (const CoveredPixel& pixel : covered) row[pixel.x] = pixel.centre_depth;
  });
}

}  // namespace polyhull
