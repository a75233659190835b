// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "base/error.h"
#include "support/refusal.h"
#include "wire/mesh_generated.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"
#include "wire_examples.h"

namespace polyhull {
namespace {

const std::vector<std::uint8_t> block_a = examples::pixels(84 * 10, 1);
const std::vector<std::uint8_t> block_b = examples::pixels(84 * 10, 2);

Mesh example_mesh() {
  return examples::mesh(block_a, block_b);
}
View example_view() {
  return examples::view("cam0", block_a);
}

void expect_same(const View& a, const View& b) {
  EXPECT_EQ(a.camera, b.camera);
  EXPECT_EQ(a.trigger, b.trigger);
  EXPECT_EQ(a.capture_time, b.capture_time);
  EXPECT_EQ(a.clock, b.clock);
  EXPECT_EQ(a.timecode, b.timecode);
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.roi, b.roi);
  EXPECT_EQ(a.contours, b.contours);
  EXPECT_EQ(a.format, b.format);
  EXPECT_EQ(a.stride, b.stride);
  ASSERT_EQ(a.pixels.size(), b.pixels.size());
  EXPECT_TRUE(std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin()));
}

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.trigger, b.trigger);
  EXPECT_EQ(a.capture_time, b.capture_time);
  EXPECT_EQ(a.up, b.up);
  EXPECT_EQ(a.metres_per_unit, b.metres_per_unit);
  EXPECT_EQ(a.opacity, b.opacity);
  EXPECT_EQ(a.hull.origin, b.hull.origin);
  EXPECT_TRUE(same_bytes(a.hull.vertices, b.hull.vertices));
  EXPECT_TRUE(same_bytes(a.hull.triangles, b.hull.triangles));
  EXPECT_TRUE(same_bytes(a.hull.faces, b.hull.faces));
  EXPECT_TRUE(same_bytes(a.hull.loop_vertices, b.hull.loop_vertices));
  EXPECT_TRUE(same_bytes(a.hull.loop_ends, b.hull.loop_ends));
  EXPECT_TRUE(same_bytes(a.hull.face_loop_ends, b.hull.face_loop_ends));
  EXPECT_TRUE(same_bytes(a.hull.normals, b.hull.normals));
  ASSERT_EQ(a.views.size(), b.views.size());
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    expect_same(a.views[i].view, b.views[i].view);
    const Camera& p = a.views[i].calibration;
    const Camera& q = b.views[i].calibration;
    EXPECT_TRUE(p.name == q.name && p.width == q.width && p.height == q.height && p.K == q.K &&
                p.distortion == q.distortion && p.R == q.R && p.t == q.t && p.colour == q.colour);
  }
  ASSERT_EQ(a.texturing.has_value(), b.texturing.has_value());
  if (!a.texturing) return;
  EXPECT_EQ(a.texturing->method, b.texturing->method);
  EXPECT_EQ(a.texturing->metric, b.texturing->metric);
  EXPECT_EQ(a.texturing->cameras, b.texturing->cameras);
  EXPECT_EQ(a.texturing->untextured, b.texturing->untextured);
  EXPECT_TRUE(same_bytes(a.texturing->visible, b.texturing->visible));
  EXPECT_TRUE(same_bytes(a.texturing->best, b.texturing->best));
  EXPECT_TRUE(same_bytes(a.texturing->weights, b.texturing->weights));
  EXPECT_TRUE(same_bytes(a.texturing->normals, b.texturing->normals));
  EXPECT_EQ(a.texturing->fill, b.texturing->fill);
  EXPECT_EQ(a.texturing->gains, b.texturing->gains);
  EXPECT_EQ(a.texturing->maps, b.texturing->maps);
  EXPECT_EQ(a.texturing->flows, b.texturing->flows);
}

TEST(ViewPayload, ComesBack) {
  const View view = example_view();
  const std::vector<std::uint8_t> bytes = write_view(view);
  expect_same(read_view(Bytes(bytes)), view);
  EXPECT_EQ(std::memcmp(bytes.data(), "PHVW", 4), 0);

  View empty;  // no foreground: no region, no contours
  empty.camera = "käm";
  empty.width = 1024;
  empty.height = 768;
  const std::vector<std::uint8_t> empty_bytes = write_view(empty);
  EXPECT_LT(empty_bytes.size(), 200u);
  expect_same(read_view(Bytes(empty_bytes)), empty);
}

TEST(ViewPayload, AnyAlignment) {
  const View view = example_view();
  const std::vector<std::uint8_t> bytes = write_view(view);
  for (std::size_t shift = 0; shift < 16; ++shift) {
    std::vector<std::uint8_t> shifted(shift, 0);
    shifted.insert(shifted.end(), bytes.begin(), bytes.end());
    expect_same(read_view(Bytes(shifted).subspan(shift)), view);
  }
}

TEST(MeshPayload, ComesBack) {
  Mesh mesh = example_mesh();
  expect_same(read_mesh(Bytes(write_mesh(mesh))), [&] { return mesh; }());
  mesh.texturing.reset();
  mesh.hull = Hull{};
  mesh.opacity = 0.25f;
  const std::vector<std::uint8_t> bytes = write_mesh(mesh);
  expect_same(read_mesh(Bytes(bytes)), mesh);
}

// What memory a header takes is known before its bytes are made.
TEST(MeshPayload, HeaderSizeIsKnownBefore) {
  Mesh mesh = example_mesh();
  EXPECT_EQ(mesh_header_size(mesh), write_mesh_header(mesh).size());
  mesh.texturing.reset();
  EXPECT_EQ(mesh_header_size(mesh), write_mesh_header(mesh).size());
  mesh.hull = Hull{};
  EXPECT_EQ(mesh_header_size(mesh), write_mesh_header(mesh).size());
}

TEST(MeshPayload, PixelsInMemoriesOfTheirOwnAreNotCopied) {
  const Mesh mesh = example_mesh();
  const std::vector<std::uint8_t> header = write_mesh_header(mesh);
  const Bytes segments[] = {header, {}, mesh.views[0].view.pixels, mesh.views[1].view.pixels};
  const Mesh read = read_mesh(segments);
  expect_same(read, mesh);
  EXPECT_EQ(read.views[0].view.pixels.data(), block_a.data());
  EXPECT_EQ(read.views[1].view.pixels.data(), block_b.data());
}

TEST(MeshPayload, CutSegmentsAskToBeJoined) {
  const std::vector<std::uint8_t> bytes = write_mesh(example_mesh());
  const std::size_t header = write_mesh_header(example_mesh()).size();
  for (const std::size_t cut : {std::size_t{8}, std::size_t{100}, header + 5, bytes.size() - 1}) {
    const Bytes segments[] = {Bytes(bytes).first(cut), Bytes(bytes).subspan(cut)};
    try {
      read_mesh(segments);
      FAIL() << cut;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::unsupported) << cut << ": " << error.what();
    }
  }
}

TEST(Payload, EveryTruncationIsRefused) {
  const std::vector<std::uint8_t> view = write_view(example_view());
  for (std::size_t size = 0; size < view.size(); ++size) {
    const std::vector<std::uint8_t> part(view.begin(), view.begin() + size);
    ASSERT_THROW(read_view(Bytes(part)), Error) << size;
  }
  const std::vector<std::uint8_t> mesh = write_mesh(example_mesh());
  for (std::size_t size = 0; size < mesh.size(); ++size) {
    const std::vector<std::uint8_t> part(mesh.begin(), mesh.begin() + size);
    ASSERT_THROW(read_mesh(Bytes(part)), Error) << size;
  }
  EXPECT_THROW(read_mesh(Bytes(view)), Error);
  EXPECT_THROW(read_view(Bytes(mesh)), Error);
}

// What was accepted keeps every promise of validate_…(), and can be written and read again.
TEST(Payload, MutatedBytesAreRefusedOrHarmless) {
  const std::vector<std::uint8_t> view = write_view(example_view());
  const std::vector<std::uint8_t> mesh = write_mesh(example_mesh());
  const std::size_t mesh_header = write_mesh_header(example_mesh()).size();
  std::mt19937 random(5);
  int accepted = 0, refused = 0;
  for (int round = 0; round < 60000; ++round) {
    std::vector<std::uint8_t> bytes = round % 2 ? view : mesh;
    const std::size_t range = round % 2 ? view.size() - 700 : mesh_header;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < changes; ++i) {
      const std::size_t at = random() % range;
      switch (random() % 4) {
        case 0:
          bytes[at] ^= static_cast<std::uint8_t>(1u << random() % 8);
          break;
        case 1:
          bytes[at] = static_cast<std::uint8_t>(random());
          break;
        case 2:
          bytes[at] = 0xFF;
          break;
        default: {
          const std::uint32_t word = random() % 3 ? static_cast<std::uint32_t>(random() % 64)
                                                  : static_cast<std::uint32_t>(random());
          std::memcpy(&bytes[at / 4 * 4], &word, 4);
        }
      }
    }
    try {
      if (round % 2) {
        const View read = read_view(Bytes(bytes));
        validate_view(read);
        expect_same(read_view(Bytes(write_view(read))), read);
      } else {
        const Mesh read = read_mesh(Bytes(bytes));
        validate_mesh(read);
        write_mesh(read);
      }
      ++accepted;
    } catch (const Error& error) {
      ASSERT_STRNE(error.what(), "");
      ++refused;
    }
  }
  EXPECT_GT(accepted, 1000);  // the changes are not all caught by the prefix alone,
  EXPECT_GT(refused, 1000);   // and many are caught
}

void expect_view_refused(const std::function<void(View&)>& change, const std::string& part) {
  View view = example_view();
  change(view);
  test::expect_refused([&] { write_view(view); }, part);
}

TEST(ViewPayload, RulesAreChecked) {
  expect_view_refused([](View& v) { v.roi.x = 50; }, "leaves the frame");
  expect_view_refused([](View& v) { v.roi.y = -1; }, "leaves the frame");
  expect_view_refused([](View& v) { v.roi.width = 0x7FFFFFFF; }, "leaves the frame");
  expect_view_refused([](View& v) { v.stride = 79; }, "stride");
  expect_view_refused([](View& v) { v.stride = 85; }, "bytes of pixels");
  expect_view_refused([](View& v) { v.pixels = v.pixels.first(10); }, "bytes of pixels");
  expect_view_refused(
      [](View& v) {
        v.pixels = block_a;
        v.stride = 80;
      },
      "bytes of pixels");
  expect_view_refused([](View& v) { v.format = PixelFormat::none; }, "all absent");
  expect_view_refused([](View& v) { v.format = static_cast<PixelFormat>(9); }, "pixel format");
  expect_view_refused([](View& v) { v.roi = {}; }, "all absent");
  expect_view_refused([](View& v) { v.width = 0; }, "each side");
  expect_view_refused([](View& v) { v.height = 40000; }, "each side");
  expect_view_refused([](View& v) { v.contours.ends = {4, 6}; }, "contour");
  expect_view_refused([](View& v) { v.contours.ends = {4}; }, "belong to no ring");
  expect_view_refused([](View& v) { v.contours.ends = {7, 4}; }, "out of order");
  expect_view_refused([](View& v) { v.contours.ends = {4, 8}; }, "out of order");
  expect_view_refused([](View& v) { v.contours.points[2].x = NAN; }, "not finite");
  expect_view_refused([](View& v) { v.contours.points[2].y = INFINITY; }, "not finite");
  expect_view_refused([](View& v) { v.camera = "\xff\xfe"; }, "UTF-8");
  expect_view_refused([](View& v) { v.camera = std::string(300, 'x'); }, "256");
}

void expect_mesh_refused(const std::function<void(Mesh&)>& change, const std::string& part) {
  Mesh mesh = example_mesh();
  change(mesh);
  test::expect_refused([&] { write_mesh(mesh); }, part);
}

/// The number after those of the contours' edges and the frame's four in the first face's view.
std::uint32_t after_frame(const Mesh& mesh) {
  const std::int32_t view = mesh.hull.faces[0].view;
  return static_cast<std::uint32_t>(mesh.views[view].view.contours.points.size() + 4);
}

TEST(MeshPayload, FacesOfAFramesBorderAreKept) {
  Mesh mesh = example_mesh();
  mesh.hull.faces[0].edge = after_frame(mesh) - 1;
  const Mesh read = read_mesh(Bytes(write_mesh(mesh)));
  EXPECT_EQ(read.hull.faces[0].edge, mesh.hull.faces[0].edge);
}

TEST(MeshPayload, RulesAreChecked) {
  expect_mesh_refused([](Mesh& m) { m.opacity = NAN; }, "opacity");
  expect_mesh_refused([](Mesh& m) { m.opacity = 1.01f; }, "opacity");
  expect_mesh_refused([](Mesh& m) { m.opacity = -0.01f; }, "opacity");
  expect_mesh_refused([](Mesh& m) { m.hull.triangles[3] = 4; }, "triangle's index");
  expect_mesh_refused([](Mesh& m) { m.hull.triangles.pop_back(); }, "multiple of three");
  expect_mesh_refused([](Mesh& m) { m.hull.vertices[1].y = NAN; }, "not finite");
  expect_mesh_refused([](Mesh& m) { m.hull.origin.z = INFINITY; }, "not finite");
  expect_mesh_refused([](Mesh& m) { m.hull.faces[0].view = 2; }, "view that is not there");
  expect_mesh_refused([](Mesh& m) { m.hull.faces[0].view = -2; }, "view that is not there");
  expect_mesh_refused([](Mesh& m) { m.hull.faces[0].edge = after_frame(m); }, "contour edge");
  expect_mesh_refused([](Mesh& m) { m.hull.faces[3].edge = 6; }, "contour edge");
  expect_mesh_refused([](Mesh& m) { m.hull.faces[2].triangle_count = 3; }, "out of range");
  expect_mesh_refused([](Mesh& m) { m.hull.faces[2].first_triangle = ~0u; }, "out of range");
  expect_mesh_refused([](Mesh& m) { m.hull.loop_ends[3] = 13; }, "loops");
  expect_mesh_refused([](Mesh& m) { m.hull.face_loop_ends.resize(3); }, "loops");
  expect_mesh_refused([](Mesh& m) { m.hull.loop_vertices[0] = 9; }, "loop's index");
  expect_mesh_refused([](Mesh& m) { m.hull.normals.resize(3); }, "normals");
  expect_mesh_refused([](Mesh& m) { m.hull.normals.assign(4, Vec3f(NAN)); }, "normal is not");
  expect_mesh_refused([](Mesh& m) { m.hull.normals[1] *= 1.1f; }, "unit length");
  expect_mesh_refused([](Mesh& m) { m.hull.faces[0].edge = HullFace::no_edge; }, "contour edge");
  expect_mesh_refused([](Mesh& m) { m.up = Vec3(0); }, "up");
  expect_mesh_refused([](Mesh& m) { m.metres_per_unit = 0; }, "unit");
  expect_mesh_refused([](Mesh& m) { m.views[0].calibration.K[0][0] = 0; }, "focal length");
  expect_mesh_refused([](Mesh& m) { m.views[0].calibration.R[0][0] += 0.1; }, "orthonormal");
  expect_mesh_refused([](Mesh& m) { m.views[0].calibration.width = 65; }, "size");
  expect_mesh_refused(
      [](Mesh& m) {
        m.views[1].calibration.name = m.views[1].view.camera = m.views[0].view.camera;
      },
      "two of its views are of camera");
  expect_mesh_refused([](Mesh& m) { m.texturing->best[0] = 2; }, "view that is not there");
  expect_mesh_refused([](Mesh& m) { m.texturing->visible[0] = 4; }, "view that is not there");
  expect_mesh_refused([](Mesh& m) { m.texturing->weights.pop_back(); }, "does not fit");
  expect_mesh_refused([](Mesh& m) { m.texturing->weights[0] = NAN; }, "not finite");
  expect_mesh_refused([](Mesh& m) { m.texturing->maps[0].width = 4; }, "contradicts");
  expect_mesh_refused([](Mesh& m) { m.texturing->maps[0].width = -3; }, "out of range");
  expect_mesh_refused([](Mesh& m) { m.texturing->maps[0].step = 0; }, "finite");
  expect_mesh_refused([](Mesh& m) { m.texturing->maps.pop_back(); }, "for every view");
  expect_mesh_refused([](Mesh& m) { m.texturing->flows[0].other = 2; }, "not there");
  expect_mesh_refused([](Mesh& m) { m.texturing->flows[0].other = 0; }, "not there");
  expect_mesh_refused([](Mesh& m) { m.texturing->flows[0].width = 3; }, "view's map");
  expect_mesh_refused([](Mesh& m) { m.texturing->flows[0].offsets.pop_back(); }, "contradicts");
  expect_mesh_refused([](Mesh& m) { m.texturing->flows.resize(3, m.texturing->flows[0]); },
                      "more flows");
  expect_mesh_refused([](Mesh& m) { m.texturing->fill.pop_back(); }, "a fill colour for every");
  expect_mesh_refused([](Mesh& m) { m.texturing->gains.pop_back(); }, "a gain for every");
  for (const float gain : {0.0f, -1.0f, 16.1f, NAN})
    expect_mesh_refused([=](Mesh& m) { m.texturing->gains[1].z = gain; }, "a view's gain");
  expect_mesh_refused([](Mesh& m) { m.texturing->method = static_cast<TextureMethod>(7); },
                      "method");
}

/// Finishes a mesh with these views; reading it must fail with `words` in the message.
void expect_views_refused(
    flatbuffers::FlatBufferBuilder& builder,
    flatbuffers::Offset<flatbuffers::Vector<flatbuffers::Offset<wire::MeshView>>> views,
    const char* words) {
  const double origin[] = {0, 0, 0};
  const auto hull = wire::CreateHull(builder, builder.CreateVector(origin, 3));
  builder.Finish(
      wire::CreateMesh(builder, 0, 0, builder.CreateVector(origin, 3), 1.0, hull, views));
  const std::vector<std::uint8_t> bytes =
      write_payload_header(PayloadKind::mesh, {builder.GetBufferPointer(), builder.GetSize()}, 0);
  test::expect_refused([&] { read_mesh(Bytes(bytes)); }, words);
}

// As bytes were before views had a clock and a timecode.
TEST(ViewPayload, WithoutClockAndTimecode) {
  flatbuffers::FlatBufferBuilder builder;
  builder.Finish(wire::CreateView(builder, builder.CreateString("x"), 7, 1234, 64, 48));
  const std::vector<std::uint8_t> bytes =
      write_payload_header(PayloadKind::view, {builder.GetBufferPointer(), builder.GetSize()}, 0);
  const View view = read_view(Bytes(bytes));
  EXPECT_EQ(view.capture_time, 1234);
  EXPECT_EQ(view.clock, CaptureClock::arrival);
  EXPECT_EQ(view.timecode, no_time);
}

TEST(ViewPayload, TimesAloneAreTheSame) {
  const std::vector<std::uint8_t> bytes = write_view(example_view());
  const Bytes run(bytes);
  const View times = read_view_times({&run, 1});
  EXPECT_EQ(times.trigger, example_view().trigger);
  EXPECT_EQ(times.capture_time, example_view().capture_time);
  EXPECT_EQ(times.clock, example_view().clock);
  EXPECT_EQ(times.timecode, example_view().timecode);
}

TEST(ViewPayload, OddClocksAndTimecodesAreRefused) {
  View view = example_view();
  view.timecode = -1;
  EXPECT_THROW(write_view(view), Error);
  view.timecode = 25LL * 3600 * 1'000'000'000 + 1;
  EXPECT_THROW(write_view(view), Error);
  view.timecode = no_time;
  view.capture_time = -1;
  EXPECT_THROW(write_view(view), Error);
  view.capture_time = latest_time + 1;
  EXPECT_THROW(write_view(view), Error);
  view.capture_time = latest_time;
  EXPECT_NO_THROW(write_view(view));
  view.clock = static_cast<CaptureClock>(4);
  EXPECT_THROW(write_view(view), Error);
}

// They are read before anything else of the view is, and calculated with.
TEST(ViewPayload, TimesAloneAreCheckedToo) {
  const auto refused = [](std::int64_t capture, std::int64_t timecode, int clock) {
    flatbuffers::FlatBufferBuilder builder;
    builder.Finish(wire::CreateView(builder, builder.CreateString("x"), 7, capture, 64, 48, 0, 0, 0,
                                    0, 0, 0, wire::PixelFormat::none, wire::PixelCoding::raw, 0, 0,
                                    static_cast<wire::CaptureClock>(clock), timecode));
    const std::vector<std::uint8_t> bytes =
        write_payload_header(PayloadKind::view, {builder.GetBufferPointer(), builder.GetSize()}, 0);
    const Bytes run(bytes);
    try {
      read_view_times({&run, 1});
      return false;
    } catch (const Error&) {
      return true;
    }
  };
  EXPECT_FALSE(refused(no_time, no_time, 0));
  EXPECT_FALSE(refused(latest_time, 0, 3));
  EXPECT_TRUE(refused(INT64_MAX, no_time, 0));
  EXPECT_TRUE(refused(no_time + 1, no_time, 0));
  EXPECT_TRUE(refused(0, INT64_MAX, 0));
  EXPECT_TRUE(refused(0, -1, 0));
  EXPECT_TRUE(refused(0, no_time, 4));
}

// A few bytes that point to one long list many times must not unpack to gigabytes.
TEST(MeshPayload, SharedContentsAreRefused) {
  flatbuffers::FlatBufferBuilder builder;
  const std::vector<float> points(30000, 1.0f);
  const std::vector<std::uint32_t> ends{15000};
  const auto view = wire::CreateView(builder, builder.CreateString("x"), 0, 0, 64, 48, 0, 0, 0, 0,
                                     builder.CreateVector(points), builder.CreateVector(ends));
  const double identity[] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const auto camera =
      wire::CreateCamera(builder, builder.CreateVector(identity, 9), 0,
                         builder.CreateVector(identity, 9), builder.CreateVector(identity, 3));
  const auto entry = wire::CreateMeshView(builder, camera, view);
  const auto views = builder.CreateVector(std::vector(200000, entry));
  expect_views_refused(builder, views, "share their contents");
}

// Nor cameras that share one long list of distortion coefficients.
TEST(MeshPayload, SharedDistortionIsRefused) {
  flatbuffers::FlatBufferBuilder builder;
  const auto view = wire::CreateView(builder, builder.CreateString("x"), 0, 0, 64, 48);
  const double identity[] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const auto camera =
      wire::CreateCamera(builder, builder.CreateVector(identity, 9),
                         builder.CreateVector(std::vector<double>(100000, 0.0)),
                         builder.CreateVector(identity, 9), builder.CreateVector(identity, 3));
  const auto entry = wire::CreateMeshView(builder, camera, view);
  const auto views = builder.CreateVector(std::vector(100000, entry));  // 80 GB as a list each
  expect_views_refused(builder, views, "distortion coefficients");
}

TEST(Payload, Utf8) {
  const auto check = [](std::string_view text) { return is_utf8({text.data(), text.size()}); };
  EXPECT_TRUE(check(""));
  EXPECT_TRUE(check("Kamera 1 \xc3\xa4 \xe2\x82\xac \xf0\x9f\x8e\xa5"));
  for (const char* bad : {"\x80", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80",
                          "\xc3", "a\xe2\x82", "\xf5\x80\x80\x80"})
    EXPECT_FALSE(check(bad)) << bad;
  EXPECT_FALSE(check(std::string_view("a\0b", 3)));
}

}  // namespace
}  // namespace polyhull
