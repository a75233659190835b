// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/view_payload.h"

#include <cmath>

#include "wire/view_table.h"

namespace polyhull {
namespace {

constexpr std::uint32_t largest_side = 32768;
constexpr float largest_coordinate = 1e6f;
constexpr std::size_t longest_name = 256;
// Timecodes of 29.97 frames/s that drop none reach midnight 86 s late.
constexpr std::int64_t latest_timecode = 90'000'000'000'000;  // ns

[[noreturn]] void fail(const View& view, const std::string& what) {
  const bool printable = view.camera.size() <= longest_name && is_utf8(view.camera);
  throw Error(Error::Kind::bad_input, "View of camera '{}': {}.", printable ? view.camera : "?",
              what);
}

void validate_times(const View& view) {
  const auto within = [](std::int64_t time, std::int64_t latest) {
    return time == no_time || (time >= 0 && time <= latest);
  };
  if (view.clock > CaptureClock::ptp) fail(view, "unknown clock of the capture time");
  if (!within(view.capture_time, latest_time))
    fail(view, fmt::format("the capture time of {} ns is not from 0 to the year 2065",
                           view.capture_time));
  if (!within(view.timecode, latest_timecode)) fail(view, "the timecode is not within a day");
}

void validate_rings(const View& view) {
  std::uint32_t begin = 0;
  for (const std::uint32_t end : view.contours.ends) {
    if (end < begin || end - begin < 3 || end > view.contours.points.size())
      fail(view, "a contour's end index is out of order or it has fewer than three vertices");
    begin = end;
  }
  if (begin != view.contours.points.size()) fail(view, "contour vertices belong to no ring");
  for (const Vec2f& p : view.contours.points)
    if (!(std::abs(p.x) <= largest_coordinate) || !(std::abs(p.y) <= largest_coordinate))
      fail(view, "a contour vertex is not finite or more than a million pixels away");
}

bool has_pixels(const View& view) {
  return view.roi != Rectangle{} && view.format != PixelFormat::none;
}

void validate_region(const View& view) {
  const Rectangle& roi = view.roi;
  if (view.format != PixelFormat::none && view.format != PixelFormat::rgba &&
      view.format != PixelFormat::grey)
    fail(view, "unknown pixel format");
  if (!has_pixels(view)) {
    if (roi != Rectangle{} || view.format != PixelFormat::none || !view.pixels.empty() ||
        view.stride != 0)
      fail(view, "region of interest, pixel format and pixels must be all there or all absent");
    return;
  }
  if (roi.x < 0 || roi.y < 0 || roi.width < 1 || roi.height < 1 || roi.width > view.width - roi.x ||
      roi.height > view.height - roi.y)
    fail(view, fmt::format("the region of interest {}x{} at ({}, {}) leaves the frame of {}x{}",
                           roi.width, roi.height, roi.x, roi.y, view.width, view.height));
  if (view.stride < roi.width * bytes_per_pixel(view.format))
    fail(view, fmt::format("the stride of {} bytes is shorter than a row", view.stride));
}

void validate_pixels(const View& view) {
  if (!has_pixels(view)) return;
  const std::size_t most = static_cast<std::size_t>(view.stride) * view.roi.height;
  if (view.pixels.size() < pixels_needed(view) || view.pixels.size() > most)
    fail(view, fmt::format("{} bytes of pixels came, the region of interest takes {} to {}",
                           view.pixels.size(), pixels_needed(view), most));
}

std::uint32_t size32(std::size_t size) {
  constexpr std::size_t longest = 0x3FFFFFFF;
  if (size > longest)
    throw Error(Error::Kind::unsupported,
                "A view's contours make a list of {} numbers; a payload's may have {} at most.",
                size, longest);
  return static_cast<std::uint32_t>(size);
}

}  // namespace

const wire::View& verified_view(const Payload& payload) {
  const Bytes buffer = payload.flatbuffer();
  flatbuffers::Verifier verifier(buffer.data(), buffer.size());
  if (!wire::VerifyViewBuffer(verifier))
    throw Error(Error::Kind::bad_input, "Not a usable view: its FlatBuffer is damaged.");
  return *wire::GetView(buffer.data());
}

int bytes_per_pixel(PixelFormat format) {
  return format == PixelFormat::rgba ? 4 : format == PixelFormat::grey ? 1 : 0;
}

std::size_t pixels_needed(const View& view) {
  if (view.roi.empty()) return 0;
  return static_cast<std::size_t>(view.stride) * (view.roi.height - 1) +
         static_cast<std::size_t>(view.roi.width) * bytes_per_pixel(view.format);
}

void validate_view(const View& view) {
  validate_all_but_pixels(view);
  validate_pixels(view);
}

void validate_all_but_pixels(const View& view) {
  if (view.camera.size() > longest_name || !is_utf8(view.camera))
    fail(view, "the camera's name is longer than 256 bytes or not UTF-8");
  const auto side_is_good = [](int side) {
    return side >= 1 && side <= static_cast<int>(largest_side);
  };
  if (!side_is_good(view.width) || !side_is_good(view.height))
    fail(view, fmt::format("the frame is {}x{}; each side must be 1 to 32768 pixels", view.width,
                           view.height));
  validate_times(view);
  if (view.stride < 0 || view.stride > 0x100000) fail(view, "the stride is out of range");
  validate_rings(view);
  validate_region(view);
}

flatbuffers::Offset<wire::View> pack_view(flatbuffers::FlatBufferBuilder& builder, const View& view,
                                          const StoredPixels& pixels) {
  const auto camera = builder.CreateString(view.camera);
  const Rings& rings = view.contours;
  const auto points = builder.CreateVector(reinterpret_cast<const float*>(rings.points.data()),
                                           size32(2 * rings.points.size()));
  const auto ends = builder.CreateVector(rings.ends.data(), size32(rings.ends.size()));
  return wire::CreateView(builder, camera, view.trigger, view.capture_time, view.width, view.height,
                          view.roi.x, view.roi.y, view.roi.width, view.roi.height, points, ends,
                          static_cast<wire::PixelFormat>(view.format),
                          static_cast<wire::PixelCoding>(pixels.coding),
                          static_cast<std::uint32_t>(pixels.stride), pixels.bytes,
                          static_cast<wire::CaptureClock>(view.clock), view.timecode);
}

View unpack_all_but_pixels(const wire::View& table) {
  const auto side = [](std::uint32_t value) {
    if (value > 0x7FFFFFFF)
      throw Error(Error::Kind::bad_input,
                  "Not a usable view: its size, offset or stride {} is beyond 31 bits.", value);
    return static_cast<int>(value);
  };
  View view;
  view.camera = table.camera()->str();
  view.trigger = table.trigger();
  view.capture_time = table.capture_time();
  view.clock = static_cast<CaptureClock>(table.capture_clock());
  view.timecode = table.timecode();
  view.width = side(table.width());
  view.height = side(table.height());
  view.roi = {side(table.roi_x()), side(table.roi_y()), side(table.roi_width()),
              side(table.roi_height())};
  view.contours.points = unpack_numbers<Vec2f>(table.points());
  view.contours.ends = unpack_numbers<std::uint32_t>(table.ends());
  view.format = static_cast<PixelFormat>(table.format());
  view.stride = side(table.stride());
  return view;
}

View unpack_view(const wire::View& table, Payload& payload) {
  if (table.coding() != wire::PixelCoding::raw)
    throw Error(
        Error::Kind::unsupported, "A view's pixels are packed ({}). Put viewdecode in front.",
        table.coding() <= wire::PixelCoding::MAX ? wire::EnumNamePixelCoding(table.coding())
                                                 : "in a way that this build does not know");
  View view = unpack_all_but_pixels(table);
  view.pixels = payload.take_block(table.pixels_size());
  validate_view(view);
  return view;
}

std::vector<std::uint8_t> write_view_header(const View& view) {
  validate_view(view);
  // Keeps its memory for the next view: they are made once per frame.
  static thread_local flatbuffers::FlatBufferBuilder builder;
  builder.Clear();
  builder.Finish(pack_view(builder, view));
  return write_payload_header(PayloadKind::view, {builder.GetBufferPointer(), builder.GetSize()},
                              view.pixels.size());
}

std::vector<std::uint8_t> write_view(const View& view) {
  std::vector<std::uint8_t> bytes = write_view_header(view);
  bytes.insert(bytes.end(), view.pixels.begin(), view.pixels.end());
  return bytes;
}

View read_view(std::span<const Bytes> segments) {
  Payload payload(PayloadKind::view, segments);
  View view = unpack_view(verified_view(payload), payload);
  payload.finish();
  return view;
}

View read_view_times(std::span<const Bytes> segments) {
  const Payload payload(PayloadKind::view, segments);
  const wire::View& table = verified_view(payload);
  View view;
  view.trigger = table.trigger();
  view.capture_time = table.capture_time();
  view.clock = static_cast<CaptureClock>(table.capture_clock());
  view.timecode = table.timecode();
  validate_times(view);
  return view;
}

View read_view(Bytes bytes) {
  return read_view({&bytes, 1});
}

}  // namespace polyhull
