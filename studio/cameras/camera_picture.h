// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The picture that a camera of a rig takes of a subject in front of a coloured screen, and the
/// truth about it: matte and depth.
#pragma once

#include <cstdint>
#include <memory>

#include "studio/cameras/coverage_raster.h"
#include "studio/cameras/sensor_noise.h"
#include "studio/cameras/studio.h"
#include "studio/figure/subject_instant.h"

namespace polyhull {

/// How the studio and the camera spoil the picture. All values 0: an ideal one.
struct PictureLook {
  Screen::Look screen;
  double shadow = 0.0;  ///< 0..1, how dark the subject's shadow on the floor is
  double spill = 0.0;   ///< 0..1, light of the screen's colour on the subject, most at its outline
  double noise = 0.0;   ///< standard deviation in 8-bit levels
  std::uint32_t seed = 0;     ///< of the noise
  bool linear_light = false;  ///< outlines mix light (as in a lens) instead of picture values
};

/// How a picture is drawn: with as much work as it needs, or the same everywhere.
enum class PictureQuality {
  fast,   ///< a surface as coarse as the pixels allow; samples where an outline passes, elsewhere
          ///< one point a pixel; lit per vertex
  exact,  ///< samples in all pixels, each lit by itself
};

/// Draws one camera of a rig. Keeps what frames have in common. Not for use by two threads at once.
class CameraPicture {
 public:
  /// \p index is the camera's number in \p rig. Throws Error if there is no such camera.
  CameraPicture(const Rig& rig, int index, std::shared_ptr<const Subject> subject,
                PictureQuality quality = PictureQuality::fast);

  /// The instant of the frames to come. Cheap where nothing changed or another camera asked for it.
  void set_time(double seconds);

  /// Does now what the first picture() with \p look would take long for.
  void prepare(const PictureLook& look);

  /// RGBA rows of \p stride bytes; \p number chooses the noise. Alpha is 255 or, where
  /// \p matte_in_alpha, the true matte.
  void picture(const PictureLook& look, std::uint64_t number, bool matte_in_alpha,
               std::uint8_t* pixels, std::ptrdiff_t stride);

  /// The true matte: the share of each pixel that the subject covers, 0..255.
  void matte(std::uint8_t* pixels, std::ptrdiff_t stride);

  /// z_cam in world units at each pixel's centre, 0 where the subject is not; rows without padding.
  void depth(float* values);

  const Camera& camera() const { return camera_; }
  const SubjectFrame& surface() const { return instant_->surface(); }
  /// What is drawn: the subject that was given, or a coarser one.
  const Subject& subject() const { return *subject_; }

  /// The smallest rectangle that holds the subject in the frame drawn last.
  const Rectangle& region() const { return region_; }

 private:
  CoverageRaster::Mesh mesh() const;
  /// How much light comes to a point from the studio, how far its surface faces the camera, how
  /// much light comes from the screen around; unused.
  using Illumination = glm::vec4;
  Illumination illumination(const Vec3f& normal, const Vec3f& position) const;
  void illuminate();
  Vec3f shade(const PictureLook& look, const Vec3f& screen_light, const SubjectFrame& frame,
              const Fragment& fragment) const;

  Camera camera_;
  int index_;
  Placement placement_;
  double metres_per_unit_;
  std::shared_ptr<const Subject> subject_;
  PictureQuality quality_;
  bool samples_outlines_ = false;  // only
  Vec3f eye_{0.0f};                // in stage coordinates
  float pixel_size_ = 0.0f;        // metres at one world unit of depth
  std::shared_ptr<const SubjectInstant> instant_;
  std::vector<Illumination> vertices_;  // of the surface, for PictureQuality::fast
  CoverageRaster raster_;
  Screen screen_;
  Screen::Look screen_look_;
  bool screen_ready_ = false;
  SensorNoise noise_;
  Rectangle region_;
};

}  // namespace polyhull
