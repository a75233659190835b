// SPDX-License-Identifier: LGPL-2.1-or-later
// Of a scene that holds no light.
#include <algorithm>
#include <string>

#include "builtin/shapes.h"
#include "element_test.h"
#include "scene/announcement.h"
#include "shown_scene.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// A floor and a box, and no lamp.
std::string dark_scene() {
  const std::string path = folder.file("dark.glb");
  Scene scene;
  scene.materials.resize(1);
  scene.meshes = {parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}),
                  box("box", 0, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f})};
  save_scene(scene, path);
  return path;
}

/// What a playing scenesrc shows of it.
struct Watched : Shown {
  explicit Watched(const std::string& properties)
      : Shown("scene=" + dark_scene() + " " + properties) {}
  /// Waits until a frame's floor, which its lower half shows, has a mean from \p low to \p high.
  void expect_mean(double low, double high) {
    wait_until("no frame of that mean came", [&] {
      if (frames.empty()) return false;
      const std::string& frame = frames.back();
      double sum = 0.0;
      for (std::size_t i = frame.size() / 2; i < frame.size(); i += 4)
        sum += static_cast<std::uint8_t>(frame[i]);
      const double mean = 8.0 * sum / static_cast<double>(frame.size());
      return mean >= low && mean <= high;
    });
  }
  void expect_warning(const std::string& text) {
    wait_until(text.c_str(), [&] {
      return std::any_of(said.begin(), said.end(), [&](const std::string& sentence) {
        return sentence.find(text) != std::string::npos;
      });
    });
  }
  Announcement last_announced() {
    g_mutex_lock(&mutex);
    const Announcement announcement = announced.back();
    g_mutex_unlock(&mutex);
    return announcement;
  }
};

}  // namespace

ELEMENT_TEST(a_scene_without_light_is_lit_by_a_sky) {
  for (const char* live : {"is-live=false", "is-live=true", "is-live=true progressive=false"}) {
    Watched watched(live);
    watched.expect_warning("holds no light: an even sky and a sun");
    watched.expect_mean(150, 230);
    const Announcement told = watched.last_announced();
    fail_unless_equals_int(told.lights.size(), 1);
    fail_unless(told.sky.x > 0.0f);
    fail_unless(told.ambient.x > 0.5f, "the sky counts as ambient light");
    // Live: the light is made brighter and taken away without being computed anew.
    watched.set("light-intensity", "0.25");
    watched.expect_mean(60, 140);
    // Subjects are lit relative to what has been dimmed.
    const Announcement dimmed = watched.last_announced();
    fail_unless(told.undimmed.empty() && !told.undimmed_sky);
    fail_unless(dimmed.undimmed == told.lights && dimmed.undimmed_sky == told.sky);
    fail_unless(dimmed.lights[0].radiance == 0.25f * told.lights[0].radiance);
    watched.set("light-intensity", "1");
    watched.expect_mean(150, 230);
    watched.set("assumed-light", "false");
    watched.expect_mean(0, 0);
    fail_unless(watched.last_announced().sky == Vec3f(0.0f));
    watched.set("assumed-light", "true");
    watched.expect_mean(150, 230);
  }
}

ELEMENT_TEST(or_dark_where_that_is_asked_for) {
  for (const char* live : {"is-live=false", "is-live=true"}) {
    Watched watched(std::string("assumed-light=false ") + live);
    watched.expect_warning("holds no light, and none is assumed");
    watched.expect_mean(0, 0);
    watched.set("assumed-light", "true");
    watched.expect_mean(150, 230);
  }
}
