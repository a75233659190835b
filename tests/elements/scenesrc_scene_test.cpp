// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes, and their lights, that change while they are shown.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "element_test.h"
#include "shown_scene.h"

using namespace polyhull;
using namespace polyhull::test;

// Not live: the frame after the scene was set shows it, to the bit as if it had been there from the
// start; the one before comes back without being lit again.
ELEMENT_TEST(the_next_frame_shows_the_next_scene) {
  const std::string a = scene_file("a.glb", 0.2f), b = scene_file("b.glb", 0.4f);
  Shown shown("num-buffers=8 scene=" + a, [&](Shown& self, std::size_t number) {
    if (number == 1) self.set("scene", b);
    if (number == 4) self.set("scene", a);
  });
  shown.wait_for_end();
  const std::string of_a = picture_of(a), of_b = picture_of(b);
  fail_unless(of_a != of_b);
  for (std::size_t i = 0; i < 8; ++i) {
    const bool is_b = i >= 2 && i <= 4;
    fail_unless(shown.frames.at(i) == (is_b ? of_b : of_a), "frame %zu", i);
    fail_unless(shown.announced[i].scene == (is_b ? b : a), "frame %zu", i);
    fail_unless_equals_int(shown.announced[i].scene_version, 0);
  }
  fail_unless_equals_uint64(shown.count("scene-changes"), 2);
  fail_unless_equals_uint64(shown.count("light-fills"), 2);
  fail_unless_equals_uint64(shown.count("frames-drawn"), 3);
}

// Live: frames go on with the last scene until the next is lit, and each is of the scene that is
// announced with it; the one before is there with the next frame.
ELEMENT_TEST(a_live_picture_goes_on_meanwhile) {
  const std::string live = "is-live=true progressive=false refinement=never light-spacing=0.02";
  const std::string a = scene_file("a.glb", 0.2f), b = scene_file("b.glb", 0.4f);
  const std::string of_a = picture_of(a, live), of_b = picture_of(b, live);
  std::size_t back = 0;
  Shown shown(live + " scene=" + a, [&](Shown& self, std::size_t number) {
    if (number == 3) self.set("scene", b);
    if (back == 0 && self.frames[number] == of_b && number % 2 == 0) {
      back = number;
      self.set("scene", a);
    }
  });
  const std::size_t first_b = shown.wait_for(of_b);
  fail_unless(first_b > 4, "frames were shown meanwhile");
  const std::size_t last = shown.wait_for(of_a, first_b);
  gst_element_set_state(shown.pipeline, GST_STATE_PAUSED);
  fail_unless_equals_int(last, back + 1);
  for (std::size_t i = 0; i <= last; ++i) {
    const bool is_b = i >= first_b && i < last;
    fail_unless(shown.frames[i] == (is_b ? of_b : of_a), "frame %zu", i);
    fail_unless(shown.announced[i].scene == (is_b ? b : a), "frame %zu", i);
  }
  fail_unless_equals_uint64(shown.count("light-fills"), 2);
}

// Live, the scene comes with the frame at which what follows has it, too, however early it is lit, and is
// asked for by the name that is announced. The path may be relative.
ELEMENT_TEST(what_follows_is_waited_for) {
  const std::string a = scene_file("a.glb", 0.2f), b = scene_file("b.glb", 0.4f);
  constexpr std::size_t unready = 60;
  Shown shown("is-live=true refinement=never progressive=false scene=" + a,
              [&](Shown& self, std::size_t number) {
                if (number != 0) return;
                self.unready = unready;
                self.set("scene", std::filesystem::relative(b).string());
              });
  const gint64 end = g_get_monotonic_time() + 30 * G_TIME_SPAN_SECOND;
  g_mutex_lock(&shown.mutex);
  while (shown.announced.empty() || shown.announced.back().scene != b)
    fail_unless(g_cond_wait_until(&shown.cond, &shown.mutex, end), "the scene came not");
  std::size_t at = 0;
  while (shown.announced[at].scene != b) ++at;
  // With each frame but the one before it was set.
  fail_unless_equals_int(at, shown.asked.size());
  fail_unless(at > unready);
  for (const std::string& asked : shown.asked) fail_unless_equals_string(asked.c_str(), b.c_str());
  g_mutex_unlock(&shown.mutex);
}

// A file that is not there is said, and the last scene stays; once it is there it is shown when it is
// set again.
ELEMENT_TEST(what_cannot_be_loaded_is_said) {
  for (const char* live : {"", "is-live=true refinement=never "}) {
    const std::string a = scene_file("a.glb", 0.2f), late = folder.file("late.glb");
    std::filesystem::remove(late);
    Shown shown(std::string(live) + "num-buffers=30 scene=" + a,
                [&](Shown& self, std::size_t number) {
                  if (number == 1) self.set("scene", late);
                  if (number == 20) {
                    scene_file("late.glb", 0.3f);
                    self.set("scene", late);
                  }
                });
    shown.wait_for_end();
    fail_unless_equals_int(shown.said.size(), 1);
    const std::string& said = shown.said.front();
    fail_unless(said.find("late.glb") != std::string::npos &&
                    said.find("a.glb', stays") != std::string::npos,
                "%s", said.c_str());
    fail_unless_equals_uint64(shown.count("scenes-unusable"), 1);
    for (std::size_t i = 0; i <= 20; ++i) fail_unless(shown.announced.at(i).scene == a);
    fail_unless(shown.announced.back().scene == late || *live != '\0');
  }
}

// What is wrong with a file that is no longer wanted is not taken for the pose's.
ELEMENT_TEST(a_wish_that_is_taken_back_is_no_pose) {
  const std::string a = scene_file("a.glb", 0.2f), none = folder.file("none.glb");
  Shown shown("is-live=true refinement=never num-buffers=12 scene=" + a,
              [&](Shown& self, std::size_t number) {
                if (number == 1) self.set("scene", none);
                if (number == 2) self.set("scene", a);
                if (number == 6) self.set("nodes", "box move=0.4,0,0");
              });
  shown.wait_for_end();
  for (const std::string& said : shown.said)
    fail_unless(said.find("pose") == std::string::npos, "%s", said.c_str());
  fail_unless(shown.announced.back().pose.nodes == "box move=0.4,0,0");
}

// A file that is written anew is another scene once it is set again, and announced as such.
ELEMENT_TEST(a_file_written_anew_is_read_again) {
  const std::string c = scene_file("c.glb", 0.2f);
  const std::string before = picture_of(c);
  std::string after;
  Shown shown("num-buffers=6 scene=" + c, [&](Shown& self, std::size_t number) {
    if (number == 1) {
      const auto written = std::filesystem::last_write_time(c);
      scene_file("c.glb", 0.4f);
      std::filesystem::last_write_time(c, written + std::chrono::seconds(2));
      after = picture_of(c);
    }
    if (number == 0 || number == 3) self.set("scene", c);
  });
  shown.wait_for_end();
  fail_unless(before != after);
  for (std::size_t i = 0; i < 6; ++i) {
    fail_unless(shown.frames.at(i) == (i <= 3 ? before : after), "frame %zu", i);
    fail_unless_equals_int(shown.announced[i].scene_version, i <= 3 ? 0 : 1);
  }
}

// A stop, or other wishes, while one is loaded.
ELEMENT_TEST(wishes_may_change_meanwhile) {
  const std::string a = scene_file("a.glb", 0.2f), b = scene_file("b.glb", 0.4f),
                    c = scene_file("c.glb", 0.3f);
  const std::string live = "is-live=true refinement=never light-spacing=0.02 progressive=false";
  const std::string of_c = picture_of(c, live);
  Shown shown(live + " scene=" + a, [&](Shown& self, std::size_t number) {
    if (number == 1) self.set("scene", b);
    if (number == 2) self.set("scene", c);
  });
  shown.wait_for(of_c);
  g_mutex_lock(&shown.mutex);
  for (const Announcement& announced : shown.announced) fail_if(announced.scene == b);
  g_mutex_unlock(&shown.mutex);
  shown.set("scene", b);
}

// A lamp that is moved and made larger from outside gives the picture of a file that has it so, with
// the next frame, and is announced so.
ELEMENT_TEST(lights_change_from_outside) {
  const std::string a = scene_file("a.glb", 0.2f), b = scene_file("b.glb", 0.2f, 2.0f);
  const std::string of_a = picture_of(a);
  // The larger lamp of the file gives twice the power.
  const std::string wide = "lamp size=2 intensity=2";
  Shown shown("num-buffers=8 scene=" + a, [&](Shown& self, std::size_t number) {
    if (number == 1) self.set("lights", wide);
    if (number == 3) self.set("lights", "");
    if (number == 5) self.set("lights", "1 move=0.3,0,0");
  });
  shown.wait_for_end();
  const std::string of_b = picture_of(b);
  fail_unless(difference(of_a, of_b) > 8);
  fail_unless(shown.frames.at(1) == of_a);
  fail_unless(difference(shown.frames.at(2), of_b) <= 2, "%d", difference(shown.frames[2], of_b));
  fail_unless(difference(shown.frames.at(4), of_a) <= 1);
  const std::string moved = picture_of(a, "light-x=0.3");
  fail_unless(difference(moved, of_a) > 8 && difference(shown.frames.at(6), moved) <= 2);
  fail_unless(std::abs(shown.announced[2].lights.at(0).u.x) +
                  std::abs(shown.announced[2].lights[0].v.x) >
              0.99f);
  fail_unless(std::abs(shown.announced[6].lights.at(0).centre.x - 0.3f) < 1e-5f);
}

// A node that is moved gives the picture of a file that has it there, announced with it; the pose before
// is there at once.
ELEMENT_TEST(nodes_move_and_vanish) {
  const std::string a = scene_file("a.glb", 0.2f), moved = scene_file("m.glb", 0.2f, 1.0f, 0.4f);
  const std::string of_a = picture_of(a);
  Shown shown("num-buffers=10 scene=" + a, [&](Shown& self, std::size_t number) {
    if (number == 1) self.set("nodes", "box move=0.4,0,0");
    if (number == 3) self.set("nodes", "");
    if (number == 5) self.set("nodes", "box visible=no; door turn=0,90,0");
  });
  shown.wait_for_end();
  fail_unless(shown.frames.at(1) == of_a && shown.frames.at(4) == of_a);
  const std::string of_moved = picture_of(moved);
  fail_unless(difference(of_a, of_moved) > 8);
  fail_unless(difference(shown.frames.at(2), of_moved) <= 2);
  fail_unless_equals_string(shown.announced[2].pose.nodes.c_str(), "box move=0.4,0,0");
  fail_unless_equals_string(shown.announced[4].pose.nodes.c_str(), "");
  fail_unless(difference(shown.frames.at(6), of_a) > 8 &&
              difference(shown.frames.at(6), of_moved) > 8);
  fail_unless_equals_uint64(shown.count("light-fills"), 3);
  fail_unless_equals_int(shown.said.size(), 1);
  fail_unless(
      shown.said[0].find("no node 'door'; it has 'floor', 'box', 'lamp'") != std::string::npos,
      "%s", shown.said[0].c_str());
}

// Of two bodies alike in one place one after the other is hidden: the one that is left is seen.
ELEMENT_TEST(variants_take_turns) {
  const std::string path = folder.file("variants.glb");
  Scene scene = load_scene(scene_file("a.glb", 0.2f));
  scene.materials.push_back({});
  scene.materials.back().base_colour = Vec3f(1.0f, 0.0f, 0.0f);
  scene.meshes.push_back(scene.meshes[1]);
  scene.meshes.back().name = "red";
  scene.meshes.back().material = static_cast<int>(scene.materials.size()) - 1;
  save_scene(scene, path);
  const char *grey = "nodes=\"red visible=no\"", *red = "nodes=\"box visible=no\"";
  Shown shown(std::string(grey) + " num-buffers=4 scene=" + path,
              [](Shown& self, std::size_t number) {
                if (number == 1) self.set("nodes", "box visible=no");
              });
  shown.wait_for_end();
  const std::string of_grey = picture_of(path, grey), of_red = picture_of(path, red);
  fail_unless(difference(of_grey, of_red) > 8);
  fail_unless(shown.frames.at(1) == of_grey && shown.frames.at(3) == of_red);
}

// What is no light change is refused, and lights that are not there are said, with those that are.
ELEMENT_TEST(lights_that_are_not_there_are_said) {
  const std::string a = scene_file("a.glb", 0.2f), of_a = picture_of(a);
  Shown shown("num-buffers=12 scene=" + a, [&](Shown& self, std::size_t number) {
    if (number == 1) self.set("lights", "sun intensity=0");
    if (number == 4) self.set("lights", "lamp intensity=-1");
    if (number == 6) self.set("lights", "lamp intensity=0");
  });
  shown.wait_for_end();
  fail_unless_equals_uint64(shown.count("lights-missing"), 1);
  fail_unless_equals_int(shown.said.size(), 2);
  fail_unless(shown.said[0].find("no light 'sun'; it has 1 'lamp'") != std::string::npos, "%s",
              shown.said[0].c_str());
  fail_unless(shown.said[1].find("light changes as in lamp") != std::string::npos, "%s",
              shown.said[1].c_str());
  for (std::size_t i = 0; i < 7; ++i) fail_unless(shown.frames.at(i) == of_a, "frame %zu", i);
  fail_unless(shown.frames.at(7) != of_a);
  gchar* lights = nullptr;
  g_object_get(shown.source, "lights", &lights, nullptr);
  fail_unless_equals_string(lights, "lamp intensity=0");
  g_free(lights);
}
