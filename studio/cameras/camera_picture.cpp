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

CameraPicture::CameraPicture(const Rig& rig, int index, std::shared_ptr<const Subject> subject,
                             PictureQuality quality)
    : index_(index),
      placement_(placement_for(rig)),
      metres_per_unit_(rig.metres_per_unit()),
      subject_(std::move(subject)),
      quality_(quality) {
  if (index < 0 || index >= static_cast<int>(rig.cameras.size())) {
    throw Error(Error::Kind::bad_input,
                "Camera number {} was asked for, but the rig has {} cameras, counted from 0.",
                index, rig.cameras.size());
  }
  camera_ = rig.cameras[index];
  eye_ = Vec3f(glm::inverse(placement_.linear) * (camera_.centre() - placement_.origin));
  pixel_size_ = static_cast<float>(2.0 * metres_per_unit_ /
                                   (std::abs(camera_.K[0][0]) + std::abs(camera_.K[1][1])));
  if (quality != PictureQuality::fast) return;
  // Metres that a pixel sees in the middle of the stage, at half the height of a person.
  const float distance = glm::distance(eye_, Vec3f(0.0f, 0.9f, 0.0f));
  const float pixel = distance * pixel_size_ / static_cast<float>(metres_per_unit_);
  if (auto coarser = subject_->coarser(pixel)) subject_ = std::move(coarser);
  samples_outlines_ = subject_->closed();
  if (samples_outlines_) subject_->neighbours();  // now, not while the first frame waits
}

void CameraPicture::set_time(double seconds) {
  if (!instant_ || instant_->seconds() != seconds) instant_ = subject_->instant(seconds);
}

CoverageRaster::Mesh CameraPicture::mesh() const {
  CoverageRaster::Mesh mesh;
  mesh.positions = surface().positions;
  mesh.triangles = subject_->triangles();
  mesh.linear = placement_.linear;
  mesh.origin = placement_.origin;
  mesh.separation = static_cast<float>(0.02 / metres_per_unit_);
  if (samples_outlines_) mesh.neighbours = subject_->neighbours();
  return mesh;
}

CameraPicture::Illumination CameraPicture::illumination(const Vec3f& normal,
                                                        const Vec3f& position) const {
  const Vec3f to_eye = glm::normalize(eye_ - position);
  return {studio_light(normal), std::max(glm::dot(normal, to_eye), 0.0f), 0.35f - 0.15f * normal.y,
          0.0f};
}

void CameraPicture::illuminate() {
  const SubjectFrame& frame = surface();
  vertices_.resize(frame.positions.size());
  parallel_each(vertices_.size(), 4096, 0, [&](std::size_t i) {
    vertices_[i] = illumination(frame.normals[i], frame.positions[i]);
  });
}

Vec3f CameraPicture::shade(const PictureLook& look, const Vec3f& screen_light,
                           const SubjectFrame& frame, const Fragment& f) const {
  const std::uint32_t* v = &subject_->triangles()[3 * static_cast<std::size_t>(f.triangle)];
  const auto mix = [&](const auto& values) {
    return values[v[0]] * f.at.x + values[v[1]] * f.at.y + values[v[2]] * f.at.z;
  };
  Illumination at;
  if (quality_ == PictureQuality::fast) {
    at = mix(vertices_);
  } else {
    const Vec3f sum = mix(frame.normals);
    const float length = glm::length(sum);
    at = illumination(length > 0.0f ? sum / length : Vec3f(0, 1, 0), mix(frame.positions));
  }
  const float brightness = at[0], facing = at[1], around = at[2];
  // A pixel sees the more of a surface, the more that is turned away.
  const float width = f.depth * pixel_size_ / std::max(facing, 0.35f);
  const Vec3f albedo = subject_->albedo(f.triangle, f.at, width);
  Vec3f light = albedo * brightness;
  if (look.spill > 0.0) {
    // From the floor and the walls around, and by reflection at grazing angles.
    const float graze = (1.0f - facing) * (1.0f - facing);
    light +=
        screen_light * static_cast<float>(look.spill) * (albedo * around + Vec3f(0.35f * graze));
  }
  return light;
}

void CameraPicture::prepare(const PictureLook& look) {
  if (!screen_ready_ || !(look.screen == screen_look_)) {
    screen_.prepare(camera_, look.screen, index_);
    screen_look_ = look.screen;
    screen_ready_ = true;
  }
  if (look.shadow > 0.0 && !screen_.has_floor()) screen_.find_floor(camera_, placement_);
  noise_.prepare(look.noise);
}

void CameraPicture::picture(const PictureLook& look, std::uint64_t number, bool matte_in_alpha,
                            std::uint8_t* pixels, std::ptrdiff_t stride) {
  prepare(look);
  const bool shadow = look.shadow > 0.0;
  const FloorShadow* floor = shadow ? &instant_->shadow() : nullptr;
  if (shadow) screen_.find_shadow(*floor);
  const auto& green = look.screen.colour;
  const Vec3f screen_light = srgb_decoded(Vec3f(green[0], green[1], green[2]) / 255.0f);
  const auto row = [&](int y) { return pixels + y * stride; };
  parallel_each(camera_.height, 32, 0, [&](int y) {
    std::memcpy(row(y), screen_.row(y), 4 * static_cast<std::size_t>(camera_.width));
    if (matte_in_alpha)
      for (int x = 0; x < camera_.width; ++x) row(y)[4 * x + 3] = 0;
    if (shadow) screen_.add_shadow(*floor, look.shadow, y, row(y));
  });
  if (quality_ == PictureQuality::fast) illuminate();
  const SubjectFrame& frame = surface();
  const std::uint8_t* codes = linear_to_srgb_table();
  region_ = raster_.draw(camera_, mesh(), [&](int y, std::span<const CoveredPixel> covered) {
    for (const CoveredPixel& pixel : covered) {
      std::uint8_t* out = row(y) + 4 * static_cast<std::size_t>(pixel.x);
      if (quality_ == PictureQuality::fast && pixel.coverage == 1.0f && pixel.fragment_count == 1) {
        const Vec3f colour = shade(look, screen_light, frame, pixel.fragments[0]);
        for (int c = 0; c < 3; ++c) out[c] = linear_to_srgb(colour[c], codes);
        if (matte_in_alpha) out[3] = 255;
        continue;
      }
      Vec3f light(0.0f), code(0.0f);
      for (int i = 0; i < pixel.fragment_count; ++i) {
        const Fragment& f = pixel.fragments[i];
        const Vec3f colour = shade(look, screen_light, frame, f);
        light += colour * f.weight;
        if (!look.linear_light) {
          code += srgb_from_linear(colour) * f.weight;
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
      mix_bits(mix_bits(mix_bits(look.seed) + number) + static_cast<std::uint64_t>(index_));
  parallel_each(camera_.height, 32, 0, [&](std::size_t y) {
    noise_.add(look.noise, mix_bits(key + y), row(static_cast<int>(y)), camera_.width);
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
