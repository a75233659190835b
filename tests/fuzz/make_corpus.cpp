// SPDX-License-Identifier: LGPL-2.1-or-later
// Writes good examples for the fuzzers into FOLDER/view, /mesh, /rig and /exchange to start from.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "../lib/wire_examples.h"
#include "rig/export.h"
#include "scene/announcement.h"
#include "studio/cameras/default_rig.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"

namespace {

constexpr char opentrackio_sample[] = R"(1{
  "static": {"camera": {"label": "A", "activeSensorPhysicalDimensions": {"width": 36.0, "height": 20.25},
                        "activeSensorResolution": {"width": 3840, "height": 2160},
                        "anamorphicSqueeze": {"num": 1, "denom": 1}}},
  "lens": {"pinholeFocalLength": 24.3, "entrancePupilOffset": 0.12,
           "projectionOffset": {"x": 0.1, "y": -0.2}, "distortionOffset": {"x": 0, "y": 0},
           "distortion": [{"model": "Brown-Conrady U-D", "tangential": [2e-5, -3e-5],
                           "radial": [-1e-4, 2e-5, 3e-8, -1e-8, 2e-11, 1e-11]}]},
  "transforms": [{"translation": {"x": 1, "y": 2, "z": 3},
                  "rotation": {"pan": 90, "tilt": -30, "roll": 0}}]})";

}  // namespace

int main(int count, char** arguments) {
  using namespace polyhull;
  if (count != 2) {
    std::cerr << "usage: make-corpus FOLDER\n";
    return 1;
  }
  const auto write = [&](const char* kind, const auto& bytes, const char* name = "example") {
    const std::filesystem::path folder = std::filesystem::path(arguments[1]) / kind;
    std::filesystem::create_directories(folder);
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const std::vector<std::uint8_t> a = examples::pixels(840, 1), b = examples::pixels(840, 2);
  write("view", write_view(examples::view("cam0", a)));
  write("mesh", write_mesh(examples::mesh(a, b)));
  write("rig", rig_to_json(default_rig()));
  // The first byte tells the fuzzer which reader.
  write("exchange", "0" + exported::kalibr(default_rig()), "kalibr");
  Announcement announcement;
  announcement.viewport = default_rig().cameras[0];
  announcement.scene = "builtin:room";
  announcement.lights.resize(2);
  std::string timed = announcement_to_json(announcement);
  timed.pop_back();
  timed +=
      R"(,"timecode":"10:00:00;02","timecode_rate":[30000,1001],"stream_time_ns":0,"unix_time_ns":1,"depth_near":0.5})";
  write("announcement", timed);
  write("exchange", std::string(opentrackio_sample), "opentrackio");
}
