// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes whose nodes move while they are shown, by an animation or the property.
#include <cmath>
#include <cstdlib>
#include <string>

#include "animated_file.h"
#include "element_test.h"
#include "shown_scene.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// The box slides by 0.4 m along x in ten frames, by the animation "slide"; "rest" does nothing.
std::string animated_file() {
  const std::string path = scene_file("animated.glb", 0.2f);
  add_animation(path, "slide", {{"box", "translation", {0, 0.2f}, {0, 0, 0, 0.4f, 0, 0}}});
  add_animation(path, "rest", {{"box", "scale", {0, 1}, {1, 1, 1, 1, 1, 1}}});
  return path;
}

/// The picture with the box at \p x.
std::string picture_at(float x) {
  return picture_of(scene_file("at.glb", 0.2f, 1.0f, x));
}

}  // namespace

// Not live each frame is the pose at its time, with its own light, as a file has it that was made so; the
// animation begins anew where it ends.
ELEMENT_TEST(each_frame_shows_its_pose) {
  Shown shown("num-buffers=13 scene=" + animated_file());
  shown.wait_for_end();
  for (const std::size_t i : {0, 5, 9, 12}) {
    const float x = 0.04f * static_cast<float>(i % 10);
    const int off = difference(shown.frames.at(i), picture_at(x));
    fail_unless(off <= 2, "frame %zu is %d off", i, off);
    fail_unless_equals_int(shown.announced[i].pose.animation, 1);
    fail_unless(std::abs(shown.announced[i].pose.animation_time -
                         0.02 * static_cast<double>(i % 10)) < 1e-6);
  }
  fail_unless(difference(shown.frames[0], shown.frames[5]) > 8);
  fail_unless_equals_uint64(shown.count("scene-changes"), 0);
  fail_unless(shown.said.empty());
}

// Of a scene that is exposed too long that is said once, whatever moves.
ELEMENT_TEST(each_scene_is_too_bright_once) {
  for (const char* live : {"", "is-live=true refinement=never "}) {
    Shown shown(std::string(live) +
                "num-buffers=30 exposure-compensation=6 field-of-view=20 target=0,0,0 scene=" +
                animated_file());
    shown.wait_for_end();
    fail_unless_equals_int(shown.said.size(), 1);
    fail_unless(shown.said[0].find("clipped") != std::string::npos, "%s", shown.said[0].c_str());
  }
}

// The choice of an animation, and its end; what stands still costs no light.
ELEMENT_TEST(animations_are_chosen) {
  const std::string file = animated_file(), rest = picture_of(scene_file("plain.glb", 0.2f));
  for (const char* choice : {"animation=0", "animation=rest"}) {
    Shown shown(std::string(choice) + " num-buffers=4 scene=" + file);
    shown.wait_for_end();
    for (const std::string& frame : shown.frames) fail_unless(frame == rest, "%s", choice);
    fail_unless_equals_uint64(shown.count("light-fills"), 1);
    fail_unless(shown.said.empty());
  }
  Shown once("animation=1 animation-loop=false num-buffers=20 scene=" + file,
             [](Shown& self, std::size_t number) {
               if (number == 14) self.set("animation", "0");
               if (number == 16) self.set("animation", "slide");
             });
  once.wait_for_end();
  fail_unless(difference(once.frames.at(12), picture_at(0.4f)) <= 2);
  fail_unless(once.frames[12] == once.frames[11]);
  // The pose before is there at once, and is the picture that is sent.
  fail_unless(once.frames.at(15) == rest && once.frames.at(17) == once.frames[12]);
  fail_unless_equals_uint64(once.count("light-fills"), 12);
  Shown none("num-buffers=6 scene=" + file, [](Shown& self, std::size_t number) {
    if (number == 2) self.set("animation", "jump");
  });
  none.wait_for_end();
  fail_unless(none.frames.at(4) == rest);
  fail_unless_equals_int(none.said.size(), 1);
  fail_unless(
      none.said[0].find("has no animation 'jump'; it has 1 'slide', 2 'rest'") != std::string::npos,
      "%s", none.said[0].c_str());
}

// One that moves nothing that is seen or lights is none: what follows has nothing to pose.
ELEMENT_TEST(what_moves_nothing_is_not_announced) {
  const std::string file = scene_file("idle.glb", 0.2f);
  change_json(file, [](nlohmann::json& root) {
    root["scenes"][0]["nodes"].push_back(root["nodes"].size());
    root["nodes"].push_back({{"name", "empty"}});
  });
  add_animation(file, "idle", {{"empty", "translation", {0, 1}, {0, 0, 0, 1, 0, 0}}});
  Shown shown("num-buffers=3 scene=" + file);
  shown.wait_for_end();
  for (const Announcement& announced : shown.announced)
    fail_unless(announced.pose == ScenePose() && announced.scene == file);
  fail_unless(shown.said.empty());
}

// Live, whatever light is to be had: each frame is at the pose that it announces, which is that of its time.
ELEMENT_TEST(live_frames_move_on) {
  Shown shown("is-live=true refinement=never num-buffers=30 scene=" + animated_file());
  shown.wait_for_end();
  std::size_t moved = 0;
  for (std::size_t i = 1; i < shown.frames.size(); ++i) {
    const double wanted = std::fmod(static_cast<double>(shown.times[i]) / GST_SECOND, 0.2f);
    fail_unless(std::abs(shown.announced[i].pose.animation_time - wanted) < 1e-6, "%f", wanted);
    if (shown.frames[i] != shown.frames[i - 1]) ++moved;
  }
  fail_unless(moved == shown.frames.size() - 1, "%zu", moved);
}

// Live, a node that is moved is there with the next frame, and its exact light follows.
ELEMENT_TEST(live_nodes_move_at_once) {
  const std::string a = scene_file("a.glb", 0.2f);
  const std::string live = "is-live=true progressive=false refinement=never ";
  const std::string of_moved = picture_of(a, live + "nodes=\"box move=0.4,0,0\"");
  Shown shown(live + "scene=" + a, [](Shown& self, std::size_t number) {
    if (number == 3) self.set("nodes", "box move=0.4,0,0");
  });
  shown.wait_for(of_moved);
  gst_element_set_state(shown.pipeline, GST_STATE_PAUSED);
  fail_unless(shown.announced[3].pose.nodes.empty() && !shown.announced[5].pose.nodes.empty());
  fail_unless(difference(shown.frames[3], shown.frames[5]) > 8);
  fail_unless_equals_uint64(shown.count("light-fills"), 2);
}
