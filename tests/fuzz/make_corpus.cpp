// SPDX-License-Identifier: LGPL-2.1-or-later
// Writes good examples for the fuzzers into FOLDER/view, /mesh, /rig and so on to start from.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "../lib/track/packets.h"
#include "../lib/wire_examples.h"
#include "builtin/default_rig.h"
#include "builtin/shapes.h"
#include "open_packet.h"
#include "rig/export.h"
#include "scene/announcement.h"
#include "scene/scene.h"
#include "take/packing.h"
#include "track/packet_file.h"
#include "track/pose_message.h"
#include "wire/coded_view.h"
#include "wire/mesh_payload.h"
#include "wire/packet.h"
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

// Other programs' calibrations, behind the byte that says whose.
constexpr const char* calibrations[] = {
    "2 1\na.png 700 0 50 0 700 50 0 0 1 1 0 0 0 1 0 0 0 1 0 0 3\n",
    "3P1 = [ 700 0 50 0 ; 0 700 50,5 0 ; ...\n 0 0 1 3D+00 ];\nCONTOUR\n",
    "4cam 1 700 0 50 0 700 50 0 0 1 0 0 0 0 0 1 0 0 0 1 0 0 0 1 0 0 3\n",
    "5%YAML:1.0\n---\nimage_Width: 640\nimage_height: 480\nfisheye_model: 0\ncamera_matrix: "
    "!!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 700., 0., 50., 0., 700., 50., "
    "0., "
    "0., 1. ]\nrvec: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0., 1. "
    "]\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0., 3. ]\n",
    "6fc = [ 700 ; 700 ];\ncc = [ 50 ; 50 ];\nnx = 100;\nny = 100;\nomc_1 = [ 0 ; NaN ; 1 ];\nTc_1 "
    "= "
    "[ 0 ; 0 ; 3 ];\n",
    "71 0.5 0.5 0.5 0.5 0 0 3 1 cam 0/1.jpg\n1 2 -1\n2 1 0 0 0 0 0 3 2 cam1\\1.jpg\n\n"};

// A scene as other programs write it, with what is optional.
constexpr char gltf[] = R"({"asset":{"version":"2.0"},"scene":0,
"scenes":[{"nodes":[0,4],"extras":{"exposure":0.5}}],
"nodes":[{"name":"n","mesh":0,"scale":[1,2,1],"rotation":[0,0,0,1],"children":[1,2,3],
"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}},
{"camera":0,"translation":[0,1,4]},{"extensions":{"KHR_lights_punctual":{"light":0}},"extras":{"size":[1,1]}},
{"extensions":{"KHR_lights_punctual":{"light":1}}},{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.7,"znear":0.1,"aspectRatio":1.5}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"material":0,"mode":5}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":0}}},
{"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"},
{"bufferView":2,"componentType":5121,"normalized":true,"count":3,"type":"VEC2"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":4},
{"buffer":0,"byteOffset":40,"byteLength":10,"byteStride":4}],
"buffers":[{"byteLength":50,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAECAAAAAAD/AAAAAP8="}],
"materials":[{"emissiveFactor":[1,1,1],"pbrMetallicRoughness":{"baseColorTexture":{"index":0,
"extensions":{"KHR_texture_transform":{"scale":[2,2],"rotation":1,"texCoord":0}}},"roughnessFactor":0},
"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":5},"KHR_materials_ior":{"ior":1.4}}}],
"textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC"}],
"extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[
{"type":"spot","spot":{"innerConeAngle":0.1,"outerConeAngle":0.5},"intensity":5},{"type":"directional"}]}}})";

using Packet = polyhull::track_examples::Packet;

/// A view packed by \p coding.
Packet coded_view(polyhull::PixelCoding coding) {
  using namespace polyhull;
  const std::vector<std::uint8_t> pixels = examples::pixels(840, 3);
  const View view = examples::view("cam0", pixels);
  const PixelShape shape{view.roi.width, view.roi.height, 4};
  PixelEncoder encoder;
  const auto block = encoder.encode(coding, shape, view.pixels, view.stride);
  Packet out = write_coded_view_header(view, coding, block.size());
  out.insert(out.end(), block.begin(), block.end());
  return out;
}

/// A packet of a buffer of 4 bytes without checksums.
Packet packet() {
  Packet out(polyhull::packet_header_size + 4);
  out[0] = 1;
  out[9] = 4;  // the payload's size
  return out;
}

/// As the fuzzer of tracks takes packets: a byte for sender and time, two for the length, the packet.
void append_packet(Packet& to, std::uint8_t time, const Packet& packet) {
  to.push_back(time);
  polyhull::track_examples::append(to, static_cast<std::uint32_t>(packet.size()), 2);
  to.insert(to.end(), packet.begin(), packet.end());
}

/// \p size bytes, \p count times.
std::string repeated(const char* bytes, std::size_t size, int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out.append(bytes, size);
  return out;
}

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
  write("scene", std::string(gltf), "text");
  Scene scene;
  scene.textures.push_back(Picture{2, 2, 4, std::vector<std::uint8_t>(16, 200)});
  scene.materials.resize(2);
  scene.materials[0].base_colour_texture = 0;
  scene.materials[1].emission = Vec3f(3.0f);
  scene.meshes = {parallelogram("floor", 0, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}),
                  parallelogram("lamp", 1, {-1, 2, -1}, {1, 0, 0}, {0, 0, 1})};
  scene.cameras = {default_rig().cameras[0]};
  save_scene(scene, (std::filesystem::path(arguments[1]) / "scene" / "binary").string());
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
  for (const std::string calibration : calibrations)
    write("exchange", calibration, calibration.substr(0, 1).c_str());
  // The first byte: 0 alone, 1 behind the same packed with loss, 3 without.
  for (const Packing packing : {Packing::exact, Packing::lossy}) {
    PacketPacker packer;
    const bool lossy = packing == Packing::lossy;
    const Packet whole = write_view(examples::view("cam0", a));
    for (const char* name : {"alone", "behind"}) {
      const PackedPacket packed = packer.pack({packing}, "application/x-polyhull-view", whole,
                                              std::string(name) == "alone" ? 0 : 1);
      Packet bytes{static_cast<std::uint8_t>(std::string(name) == "alone" ? 0 : lossy ? 1 : 3)};
      bytes.insert(bytes.end(), packed.data.begin(), packed.data.end());
      write("packed_take", bytes, (name + std::string(lossy ? "-lossy" : "-exact")).c_str());
    }
    // 4: opened, a view and a mesh.
    const Packet mesh = write_mesh(examples::mesh(a, b));
    for (const auto& [kind, packet] : {std::pair{"view", &whole}, std::pair{"mesh", &mesh}}) {
      PacketPacker alone;
      const PackedPacket packed =
          alone.pack({packing}, std::string("application/x-polyhull-") + kind, *packet, 0);
      Packet bytes = test::open_packet(packed.data);
      bytes.insert(bytes.begin(), 4);
      write("packed_take", bytes,
            (std::string("open-") + kind + (lossy ? "-lossy" : "-exact")).c_str());
    }
  }
  write("packet", packet());
  for (const PixelCoding coding : {PixelCoding::lz4, PixelCoding::zstd, PixelCoding::jpeg})
    write("packet", coded_view(coding),
          ("view" + std::to_string(static_cast<int>(coding))).c_str());
  const nlohmann::json sample = track_examples::sample({10, 20, 30}, {1, 2, 3});
  const Packet freed = track_examples::freed(7, {10, 20, 30}, {1, 2, 3}, 100, 200);
  const Packet text = track_examples::json_bytes(sample);
  write("freed", freed);
  write("lens_table",
        std::string("zoom focus focal_length_mm k1 entrance_pupil_cm\n0 0 5 -0.1 6\n0 9 6 -.1 6\n"
                    "0x40 5 50 0.02 9 # far\n"),
        "blanks");
  write("lens_table",
        std::string("Zoom,hfov deg,K2,P1,K6,Projection offset x [mm]\r\n0,60,0,0,0,0.1\r\n"
                    "1,5,0.1,0,0,0\r\nFocus,Focus distance (ft)\r\n0,2\r\n1,inf\r\n"),
        "commas");
  write("key_frames",
        std::string(R"({"format":"polyhull-key-frames","version":1,"description":"a","keys":[
{"time":0,"eye":[0,1,3],"target":[0,1,0],"field-of-view":40},
{"time":1,"eye":[2,1,3],"easing":"ease-in-out"},{"time":1,"cut":true,"target":[0,1,1]},
{"time":2.5,"easing":"linear"},{"time":3,"easing":"smooth"}]})"));
  write("environment",
        std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 1 +X 2\n\x80\x10\x20\x81"
                    "\x01\x02\x03\x7f"),
        "plain");
  write("environment",
        std::string("#?RADIANCE\n\n-Y 4 +X 8\n") +
            repeated("\x02\x02\x00\x08\x88\x10\x88\x20\x83\x30\x05\x01\x02\x03\x04\x05\x88\x81", 18,
                     4),
        "packed");
  write("subject",
        std::string(
            "mtllib a.mtl\no a\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nv 1,5 1 0\nvt 0 0\nvn 0 0 1\n"
            "usemtl m\nf 1/1/1 2//1 3/1\nf -1 -2 -3 -4\n"));
  write("opentrackio", text, "json");
  write("opentrackio", nlohmann::json::to_cbor(sample), "cbor");
  write("opentrackio", track_examples::segment(text, 1, 1, 0, text.size(), 255), "segment");
  nlohmann::json lens = sample;
  lens["lens"]["distortion"] = {{{"radial", {-1e-4, 0.0, 1e-8}}, {"tangential", {1e-6, 1e-6}}}};
  lens["static"]["camera"]["anamorphicSqueeze"] = {{"num", 2}, {"denom", 1}};
  lens["transforms"][0]["scale"] = {{"x", 1}, {"y", 2}, {"z", 3}};
  write("opentrackio", track_examples::json_bytes(lens), "squeezed");
  lens["static"]["camera"].erase("anamorphicSqueeze");
  write("opentrackio", track_examples::json_bytes(lens), "lens");
  write("track", pose_message_to_json({}), "message");
  Packet packets;
  append_packet(packets, 8, freed);
  append_packet(packets, 9, track_examples::segment(text, 1, 1, 0, text.size(), 255));
  write("track", packets, "packets");
  const std::filesystem::path recording = std::filesystem::path(arguments[1]) / "recording";
  std::filesystem::create_directories(recording);
  PacketRecorder recorder(recording / "example", 40000);
  recorder.write({0, 0x7F000001, 50000, freed});
  recorder.write({20'000'000, 0x7F000001, 50000, text});
  write("remote_settings",
        std::string("number=-3 real=.5 flag=true whole=7 format=bytes fraction=1/2"), "numbers");
  write("remote_settings", std::string("inside-polygon='0,0 1,0 1,1' number=2"), "polygon");
  write("remote_settings", std::string("name=sink location=/dev/zero size=1"), "refused");
  write("packet_text", std::string("1application/x-polyhull-view, camera=(string)cam0"), "caps");
  write("packet_text",
        std::string(
            "2offset=(guint64)0, start=(guint64)0, stop=(guint64)18446744073709551615, "
            "time=(guint64)0, position=(guint64)0, duration=(guint64)18446744073709551615;\""),
        "segment");
}
