// SPDX-License-Identifier: LGPL-2.1-or-later
// Packed packets: the same again, or within what is said; small where little changes; from bytes that
// lie nothing but an error.
#include "take/packing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "base/error.h"
#include "take/packed_layout.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"
#include "wire_examples.h"

namespace polyhull {
namespace {

using Data = std::vector<std::uint8_t>;
constexpr char view_caps[] = "application/x-polyhull-view";
constexpr char mesh_caps[] = "application/x-polyhull-mesh";

Data view_bytes(const View& view) {
  Data bytes = write_view_header(view);
  bytes.insert(bytes.end(), view.pixels.begin(), view.pixels.end());
  return bytes;
}

/// A region of \p channels that wanders over a frame whose content stands still but for noise.
struct Scene {
  explicit Scene(int channels, int noise) : channels(channels), noise(noise) {}

  View view(int number) {
    View view;
    view.camera = "cam0";
    view.trigger = static_cast<std::uint64_t>(number);
    view.width = 640;
    view.height = 480;
    view.roi = {101 + 3 * (number % 4), 57 + number % 3, 133 + number % 5, 97 + 2 * (number % 2)};
    view.contours.points = {{110, 60}, {110, 140}, {200 + 0.125f * number, 100}};
    view.contours.ends = {3};
    view.format = channels == 4 ? PixelFormat::rgba : PixelFormat::grey;
    view.stride = view.roi.width * channels;
    pixels.clear();
    for (int y = view.roi.y; y < view.roi.y + view.roi.height; ++y)
      for (int x = view.roi.x; x < view.roi.x + view.roi.width; ++x)
        for (int c = 0; c < channels; ++c) pixels.push_back(value(x, y, c));
    view.pixels = pixels;
    return view;
  }

  std::uint8_t value(int x, int y, int c) {
    if (c == 3)
      return x + y < 200 ? 0 : x + y < 210 ? static_cast<std::uint8_t>(25 * (x + y - 200)) : 255;
    const double still = 128 + 60 * std::sin(0.11 * x + c) + 50 * std::cos(0.07 * y * (1 + c));
    const int random_part = noise > 0 ? static_cast<int>(random() % (2 * noise + 1)) - noise : 0;
    return static_cast<std::uint8_t>(std::clamp(static_cast<int>(still) + random_part, 0, 255));
  }

  int channels, noise;
  std::minstd_rand random{7};
  Data pixels;
};

/// A mesh of random vertices \p metres_per_unit, seen by two cameras.
Data mesh_bytes(int number, double metres_per_unit) {
  std::mt19937 random(static_cast<unsigned>(number));
  const Data block = examples::pixels(84 * 9 + 80, number);
  Mesh mesh = examples::mesh(block, block);
  mesh.texturing.reset();
  mesh.metres_per_unit = metres_per_unit;
  mesh.hull.faces.clear();
  mesh.hull.loop_vertices.clear();
  mesh.hull.loop_ends.clear();
  mesh.hull.face_loop_ends.clear();
  mesh.hull.normals.clear();
  mesh.hull.vertices.clear();
  std::uniform_real_distribution<float> place(-1.0f, 1.0f);
  const auto size = static_cast<float>(1.0 / metres_per_unit);
  for (int i = 0; i < 300; ++i)
    mesh.hull.vertices.push_back(size * Vec3f(place(random), place(random), place(random)));
  mesh.hull.triangles.clear();
  for (int i = 0; i < 1800; ++i) mesh.hull.triangles.push_back(random() % 300);
  return write_mesh(mesh);
}

PackingSettings exact(unsigned interval = 8) {
  PackingSettings settings;
  settings.packing = Packing::exact;
  settings.key_interval = interval;
  return settings;
}

PackingSettings lossy(double precision = 0.1, int quantizer = 16) {
  PackingSettings settings;
  settings.packing = Packing::lossy;
  settings.precision = precision;
  settings.quantizer = quantizer;
  return settings;
}

/// Packs, unpacks and holds against what went in.
struct Chain {
  Data pass(const PackingSettings& settings, const char* caps, const Data& packet) {
    packed = packer.pack(settings, caps, packet, id);
    if (packed.data.empty()) {
      id = 0;
      return packet;
    }
    return unpacker.unpack(++id, packed.data);
  }
  PacketPacker packer;
  PacketUnpacker unpacker;
  PackedPacket packed;
  std::int64_t id = 0;
};

double squared_error(const View& a, const View& b, int* matte) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const int less = a.pixels[i] - b.pixels[i];
    if (i % 4 == 3) {
      *matte = std::max(*matte, std::abs(less));
    } else {
      sum += less * less;
    }
  }
  return sum;
}

// A seek unpacks no more than 8 MiB.
TEST(TakePacking, LargePacketsStandAloneSooner) {
  Chain chain;
  const Data large(5u << 19, 7), small(1000, 7);
  std::string alone;
  for (int i = 0; i < 8; ++i) {
    ASSERT_EQ(chain.pass(exact(250), "application/x-test", large), large);
    alone += chain.packed.alone ? '1' : '0';
  }
  EXPECT_EQ(alone, "10010010");
  for (int i = 0; i < 200; ++i) {
    chain.pass(exact(250), "application/x-test", small);
    EXPECT_FALSE(chain.packed.alone) << i;
  }
}

TEST(TakePacking, ExactIsTheSameToTheByte) {
  for (const int channels : {1, 4}) {
    for (const int noise : {0, 3}) {
      Scene scene(channels, noise);
      Chain chain;
      for (int i = 0; i < 40; ++i) {
        const Data packet = view_bytes(scene.view(i));
        ASSERT_EQ(chain.pass(exact(), view_caps, packet), packet) << i;
        ASSERT_FALSE(chain.packed.data.empty());
        EXPECT_EQ(chain.packed.alone, i % 8 == 0) << i;
      }
    }
  }
  Chain chain;
  for (int i = 0; i < 20; ++i) {
    const Data packet = mesh_bytes(i, 0.001);
    ASSERT_EQ(chain.pass(exact(), mesh_caps, packet), packet) << i;
    EXPECT_LT(chain.packed.data.size(), packet.size());
  }
}

// Of every member of a mesh.
TEST(TakePacking, AFullMeshIsTheSameToTheByte) {
  const Data a = examples::pixels(84 * 9 + 80, 1), b = examples::pixels(84 * 9 + 80, 2);
  const Data packet = write_mesh(examples::mesh(a, b));
  for (const PackingSettings& settings : {exact(), lossy(0)}) {
    Chain chain;
    for (int i = 0; i < 3; ++i) ASSERT_EQ(chain.pass(settings, mesh_caps, packet), packet);
    EXPECT_FALSE(chain.packed.data.empty());
  }
}

TEST(TakePacking, WhatStaysIsTold) {
  // A picture without noise, whose region wanders: what the packet before has costs nothing.
  Scene scene(4, 0);
  Chain chain;
  chain.pass(exact(), view_caps, view_bytes(scene.view(0)));
  const std::size_t alone = chain.packed.data.size();
  chain.pass(exact(), view_caps, view_bytes(scene.view(1)));
  EXPECT_LT(chain.packed.data.size(), alone / 3);
  // So do bytes of any kind that come again.
  Data noise(50'000);
  std::minstd_rand random(3);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(random() >> 9);
  noise.insert(noise.end(), 1000, 0);  // a little to gain even alone
  Chain other;
  EXPECT_EQ(other.pass(exact(), "application/x-test", noise), noise);
  ASSERT_FALSE(other.packed.data.empty());
  EXPECT_EQ(other.pass(exact(), "application/x-test", noise), noise);
  EXPECT_LT(other.packed.data.size(), 1000u);
}

TEST(TakePacking, WhatDoesNotGetSmallerStaysAsItIs) {
  Data noise(5000);
  std::minstd_rand random(3);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(random() >> 9);
  PacketPacker packer;
  EXPECT_TRUE(packer.pack(exact(), "application/x-test", noise, 0).data.empty());
  EXPECT_TRUE(packer.pack(exact(), "application/x-test", {}, 0).data.empty());
  EXPECT_TRUE(packer.pack({}, "application/x-test", Data(5000), 0).data.empty());
  // What follows counts on nothing that was not packed.
  const PackedPacket next = packer.pack(exact(), "application/x-test", Data(5000), 9);
  EXPECT_FALSE(next.data.empty());
  EXPECT_TRUE(next.alone);
}

TEST(TakePacking, OtherSettingsOrCapsBeginAnew) {
  Scene scene(4, 1);
  Chain chain;
  const Data packet = view_bytes(scene.view(0));
  chain.pass(exact(), view_caps, packet);
  chain.pass(exact(), view_caps, packet);
  EXPECT_FALSE(chain.packed.alone);
  chain.pass(lossy(), view_caps, packet);
  EXPECT_TRUE(chain.packed.alone);
  chain.pass(lossy(), "application/x-polyhull-view, other=1", packet);
  EXPECT_TRUE(chain.packed.alone);
  chain.id = 0;  // it was not written
  chain.pass(lossy(), "application/x-polyhull-view, other=1", packet);
  EXPECT_TRUE(chain.packed.alone);
}

TEST(TakePacking, VerticesStayWithinThePrecision) {
  for (const double unit : {1.0, 0.001, 0.0254})
    for (const double precision : {0.01, 0.1, 3.0}) {
      Chain chain;
      double most = 0;
      std::size_t size = 0, exact_size = 0;
      for (int i = 0; i < 10; ++i) {
        const Data packet = mesh_bytes(i, unit);
        const Mesh was = read_mesh(Bytes(packet));
        const Data came = chain.pass(lossy(precision), mesh_caps, packet);
        const Mesh is = read_mesh(Bytes(came));
        ASSERT_EQ(is.hull.triangles, was.hull.triangles);
        ASSERT_EQ(is.hull.vertices.size(), was.hull.vertices.size());
        double worst = 0;
        for (std::size_t v = 0; v < was.hull.vertices.size(); ++v) {
          const Vec3 moved = Vec3(is.hull.vertices[v]) - Vec3(was.hull.vertices[v]);
          worst = std::max(worst, 1000.0 * unit * glm::length(moved));
        }
        EXPECT_NEAR(chain.packed.vertex_error, worst, 1e-9);
        most = std::max(most, worst);
        size += chain.packed.data.size();
        PacketPacker alone;
        exact_size += alone.pack(exact(), mesh_caps, packet, 0).data.size();
      }
      // Floats of a metre's vertices are exact to 60 nm.
      EXPECT_LE(most, precision + 1.2e-4) << unit;
      EXPECT_GT(most, 0.8 * precision) << unit;
      EXPECT_LT(size, exact_size);
    }
}

// What cannot be put on a grid stays where it is.
TEST(TakePacking, AGridTooFineChangesNothing) {
  const Data packet = mesh_bytes(1, 1.0);
  Chain chain;
  const Mesh was = read_mesh(Bytes(packet));
  const Data came = chain.pass(lossy(1e-7), mesh_caps, packet);
  EXPECT_EQ(read_mesh(Bytes(came)).hull.vertices, was.hull.vertices);
  EXPECT_EQ(chain.packed.vertex_error, 0.0);
}

TEST(TakePacking, PicturesAreAsGoodAsIsSaid) {
  double last = 1e30;
  for (const int quantizer : {2, 20, 50}) {
    Scene scene(4, 2);
    Chain chain;
    double error = 0, colours = 0;
    std::size_t size = 0, raw = 0;
    for (int i = 0; i < 20; ++i) {
      const View view = scene.view(i);
      const Data packet = view_bytes(view);
      const Data came = chain.pass(lossy(0.1, quantizer), view_caps, packet);
      const View is = read_view(Bytes(came));
      EXPECT_EQ(is.contours.points, view.contours.points);
      EXPECT_EQ(is.trigger, view.trigger);
      int matte = 0;
      const double sum = squared_error(view, is, &matte);
      EXPECT_LE(matte, 4);
      EXPECT_DOUBLE_EQ(chain.packed.colour_error, sum) << i;
      error += sum;
      colours += static_cast<double>(chain.packed.colours);
      size += chain.packed.data.size();
      raw += packet.size();
    }
    const double psnr = 10 * std::log10(65025 * colours / error);
    std::printf("quantizer %d: %.1f dB, 1/%.0f of the bytes\n", quantizer, psnr,
                static_cast<double>(raw) / static_cast<double>(size));
    EXPECT_GT(psnr, quantizer < 10 ? 36 : quantizer < 30 ? 33 : 26);
    EXPECT_LT(psnr, last);
    EXPECT_LT(size, raw / 8);
    last = psnr;
  }
}

// A matte's ends are what decides.
TEST(TakePacking, InsideStaysInsideAndOutsideOutside) {
  Scene scene(4, 0);
  const View view = scene.view(0);
  const Data packet = view_bytes(view);
  Chain chain;
  const Data came = chain.pass(lossy(), view_caps, packet);
  const View is = read_view(Bytes(came));
  for (std::size_t i = 3; i < view.pixels.size(); i += 4) {
    EXPECT_EQ(is.pixels[i] == 0, view.pixels[i] == 0) << int{view.pixels[i]};
    EXPECT_EQ(is.pixels[i] == 255, view.pixels[i] == 255) << int{view.pixels[i]};
  }
}

// The subject jumps, grows over its canvas, and is gone.
TEST(TakePacking, RegionsMayGoAnywhere) {
  std::mt19937 random(5);
  Chain chain;
  for (int i = 0; i < 60; ++i) {
    View view;
    view.camera = "cam0";
    view.width = 1000;
    view.height = 700;
    Data pixels;
    if (i % 11 != 10) {
      view.roi.x = static_cast<int>(random() % 900);
      view.roi.y = static_cast<int>(random() % 600);
      view.roi.width = 1 + static_cast<int>(random() % static_cast<unsigned>(1000 - view.roi.x));
      view.roi.height = 1 + static_cast<int>(random() % static_cast<unsigned>(700 - view.roi.y));
      view.format = PixelFormat::rgba;
      view.stride = 4 * view.roi.width;
      pixels.assign(static_cast<std::size_t>(view.stride * view.roi.height), 90);
      view.pixels = pixels;
    }
    const Data packet = view_bytes(view);
    const Data came = chain.pass(lossy(), view_caps, packet);
    const View is = read_view(Bytes(came));
    ASSERT_EQ(is.roi, view.roi);
    for (std::size_t p = 0; p < pixels.size(); p += 4)
      ASSERT_NEAR(is.pixels[p], 90, 16) << "frame " << i << " pixel " << p / 4;
  }
}

// The subject is out of the frame just where a packet stands alone: what follows is the same from
// there as from the begin, and after whatever was unpacked before.
TEST(TakePacking, ASeekIsRightWhereWhatStandsAloneHasNoPicture) {
  constexpr int interval = 4, count = 16;
  Scene scene(4, 3);
  PackingSettings settings = lossy();
  settings.key_interval = interval;
  PacketPacker packer;
  PacketUnpacker through;
  std::vector<Data> packed, truth;
  for (int i = 0; i < count; ++i) {
    View view = scene.view(i);
    if (i % interval == 0 && i > 0)
      view.roi = {}, view.format = PixelFormat::none, view.stride = 0, view.pixels = {};
    const PackedPacket packet = packer.pack(settings, view_caps, view_bytes(view), i);
    ASSERT_FALSE(packet.data.empty());
    ASSERT_EQ(packet.alone, i % interval == 0);
    packed.emplace_back(packet.data.begin(), packet.data.end());
    truth.push_back(through.unpack(i + 1, packed.back()));
  }
  for (int key = 0; key < count; key += interval)
    for (int before : {0, 3}) {
      PacketUnpacker fresh;
      for (int i = 0; i < before; ++i) fresh.unpack(i + 1, packed[i]);
      for (int i = key; i < key + interval; ++i)
        ASSERT_EQ(fresh.unpack(i + 1, packed[i]), truth[i]) << "packet " << i;
    }
}

TEST(TakePacking, LiesAreRefused) {
  Scene scene(4, 1);
  PacketPacker packer;
  const PackedPacket packed = packer.pack(lossy(), view_caps, view_bytes(scene.view(0)), 0);
  const Data sound(packed.data.begin(), packed.data.end());
  const auto refused = [&](auto&& change) {
    Data bytes = sound;
    PackedPrefix prefix;
    std::memcpy(&prefix, bytes.data(), sizeof prefix);
    change(prefix);
    std::memcpy(bytes.data(), &prefix, sizeof prefix);
    PacketUnpacker unpacker;
    EXPECT_THROW(unpacker.unpack(1, bytes), Error);
    EXPECT_EQ(unpacker.last(), 0);
  };
  refused([](PackedPrefix& p) { p.before = 5; });
  refused([](PackedPrefix& p) { p.version = 2; });
  refused([](PackedPrefix& p) { p.size = 0xffffffffu; });
  refused([](PackedPrefix& p) { p.size += 1; });
  refused([](PackedPrefix& p) { p.head = 0xfffffff0u; });
  refused([](PackedPrefix& p) { p.head -= 1; });
  refused([](PackedPrefix& p) { p.head_packed = 0xffffffffu; });
  refused([](PackedPrefix& p) { p.head_packed -= 1; });
  refused([](PackedPrefix& p) { p.pictures = 0xffffffffu; });
  refused([](PackedPrefix& p) { p.pictures += 1; });
  refused([](PackedPrefix& p) { p.pictures_packed += 1; });
  PacketUnpacker unpacker;
  EXPECT_THROW(unpacker.unpack(1, {}), Error);
  EXPECT_THROW(unpacker.unpack(1, Bytes(sound).first(31)), Error);
  EXPECT_THROW(unpacker.unpack(1, Bytes(sound).first(sound.size() - 1)), Error);
  EXPECT_EQ(unpacker.unpack(1, sound).size(), view_bytes(scene.view(0)).size());
}

Data head_of(std::initializer_list<Region> regions) {
  const auto count = static_cast<std::uint32_t>(regions.size());
  Data head(4 + 64 * count);
  std::memcpy(head.data(), &count, 4);
  if (count > 0) std::memcpy(head.data() + 4, regions.begin(), 64 * count);
  return head;
}

TEST(TakePacking, RegionsThatLieAreRefused) {
  Region numbers;
  numbers.offset = 10;
  numbers.size = 40;
  numbers.element = 4;
  numbers.components = 3;
  Region video;
  video.kind = RegionKind::video;
  video.offset = 50;
  video.size = 4 * 20 * 10;
  video.element = 4;
  video.x = 40;
  video.width = 20;
  video.height = 10;
  video.canvas_x = 32;
  video.canvas_width = 48;
  video.canvas_height = 16;
  EXPECT_EQ(read_regions(head_of({numbers, video}), 850).size(), 2u);
  EXPECT_THROW(read_regions(head_of({video, numbers}), 850), Error);
  EXPECT_THROW(read_regions(head_of({numbers, video}), 849), Error);
  EXPECT_THROW(read_regions(Bytes(head_of({numbers})).first(60), 850), Error);
  const auto refused = [](Region region, auto&& change) {
    change(region);
    EXPECT_THROW(read_regions(head_of({region}), 850), Error);
  };
  refused(numbers, [](Region& r) { r.element = 3; });
  refused(numbers, [](Region& r) { r.element = 0; });
  refused(numbers, [](Region& r) { r.size = 41; });
  refused(numbers, [](Region& r) { r.size = 0xfffffffcu; });
  refused(numbers, [](Region& r) { r.offset = 0xfffffff0u; });
  refused(numbers, [](Region& r) { r.components = 0; });
  refused(numbers, [](Region& r) { r.kind = RegionKind::grid; });
  refused(numbers, [](Region& r) { r.kind = static_cast<RegionKind>(4); });
  refused(video, [](Region& r) { r.width = 21; });
  refused(video, [](Region& r) { r.element = 1; });
  refused(video, [](Region& r) { r.canvas_width = 16384; });
  refused(video, [](Region& r) { r.canvas_width = 8192; });  // far more memory than it fills
  refused(video, [](Region& r) { r.canvas_width = 27; });
  refused(video, [](Region& r) { r.canvas_x = 41; });
  refused(video, [](Region& r) { r.y = 0xffffffffu; });
}

// Changed bytes behind sums that are right: an error or other bytes, never more.
TEST(TakePacking, AnyChangeIsSurvived) {
  std::mt19937 random(9);
  Scene scene(4, 1);
  int refused = 0, other = 0;
  for (int round = 0; round < 300; ++round) {
    PacketPacker packer;
    PacketUnpacker unpacker;
    std::int64_t id = 0;
    for (int i = 0; i < 3; ++i) {
      const Data packet = round % 3 == 0 ? mesh_bytes(i, 1.0) : view_bytes(scene.view(i));
      const PackedPacket packed = packer.pack(round % 2 == 0 ? lossy() : exact(),
                                              round % 3 == 0 ? mesh_caps : view_caps, packet, id);
      Data bytes(packed.data.begin(), packed.data.end());
      const std::size_t changes = 1 + random() % 4;
      for (std::size_t c = 0; c < changes; ++c) {
        // Most of what can be said lies in front.
        const std::size_t at = random() % (random() % 2 == 0 ? 32 : bytes.size());
        bytes[at] = static_cast<std::uint8_t>(random());
      }
      ++id;
      try {
        unpacker.unpack(id, bytes);
        ++other;
      } catch (const Error&) {
        ++refused;
        break;
      }
    }
  }
  std::printf("%d refused, %d unpacked\n", refused, other);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace polyhull
