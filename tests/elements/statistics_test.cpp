// SPDX-License-Identifier: LGPL-2.1-or-later
// What elements count while they work has the type that docs/embedding.md says of its name.

#include <string>

#include "element_checks.h"
#include "plugins/common/elements_in.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// Runs \p line to its end and checks each element's `stats`, figures of the last frame included.
void check_types(const std::string& line) {
  GstElement* pipeline = parse(line);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  for (const element::Ref<GstElement>& each : element::elements_in(GST_BIN(pipeline)))
    if (g_str_has_prefix(G_OBJECT_TYPE_NAME(each.get()), "Polyhull"))
      check_statistic_types(each.get());
  stop(pipeline);
}

/// Four cameras' frames, through \p keying, at whose end the camera's name follows.
std::string views(const std::string& keying, const std::string& after = "") {
  std::string line;
  for (const char* camera : {"cam0", "cam1", "cam2", "cam3"}) {
    const std::string name = std::string(" camera=") + camera + " ";
    line += "rigtestsrc num-buffers=3" + name + "! video/x-raw,format=RGBx ! " + keying + name +
            after + "! hull. ";
  }
  return line;
}

ELEMENT_TEST(figures_are_doubles_and_counts_are_whole_numbers) {
  check_types(
      views("chromamatte ! gaussblur ! contourfind") +
      "hullbuild name=hull repair=holes ! hullrefine photo=true quality=fast ! "
      "hulltexture balance=on align=flow memory=on ! mix.mesh_0 "
      "scenesrc path=orbit num-buffers=3 light-spacing=0.5 light-cache=false ! "
      "video/x-raw,width=160,height=90,framerate=25/1 ! mix.background "
      "composite name=mix depth-of-field=subject aperture=20 motion-blur=subject ! fakesink");
}

ELEMENT_TEST(the_same_of_views_that_are_packed) {
  check_types(views("silhouette", "! viewencode ! viewdecode ") +
              "hullbuild name=hull max-deviation=0.004 ! fakesink");
}

}  // namespace
