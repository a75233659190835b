// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/picture_video.h"

#include <libyuv.h>
#include <vpx/vp8cx.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>
#include <vpx/vpx_encoder.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>
#include <vector>

#include "base/error.h"

namespace polyhull {
namespace {

// Of libvpx's speeds the fastest that a camera's size does not change.
constexpr int speed = 8;

struct Destroy {
  void operator()(vpx_codec_ctx_t* codec) const {
    vpx_codec_destroy(codec);
    delete codec;
  }
};
using Codec = std::unique_ptr<vpx_codec_ctx_t, Destroy>;

struct FreeImage {
  void operator()(vpx_image_t* image) const { vpx_img_free(image); }
};

/// The region in the canvas, grown to whole samples of the halved colours.
struct Place {
  explicit Place(const Region& region)
      : x(region.x - region.canvas_x),
        y(region.y - region.canvas_y),
        left(x & ~1u),
        top(y & ~1u),
        width(std::min((x + region.width + 1) & ~1u, region.canvas_width) - left),
        height(std::min((y + region.height + 1) & ~1u, region.canvas_height) - top) {}
  std::uint32_t x, y;                      // of the region
  std::uint32_t left, top, width, height;  // of what is converted
};

struct Planes {
  Planes(const vpx_image_t& image, const Place& place)
      : y(at(image, VPX_PLANE_Y, place.left, place.top)),
        u(at(image, VPX_PLANE_U, place.left / 2, place.top / 2)),
        v(at(image, VPX_PLANE_V, place.left / 2, place.top / 2)) {}
  static std::uint8_t* at(const vpx_image_t& image, int plane, std::uint32_t x, std::uint32_t y) {
    return image.planes[plane] + static_cast<std::ptrdiff_t>(y) * image.stride[plane] + x;
  }
  std::uint8_t *y, *u, *v;
};

/// The image's colours at \p place as RGBA (libyuv's ABGR) without gaps.
void to_rgba(const vpx_image_t& image, const Place& place, std::vector<std::uint8_t>& rgba) {
  rgba.resize(std::size_t{4} * place.width * place.height);
  const Planes planes(image, place);
  libyuv::J420ToABGR(planes.y, image.stride[VPX_PLANE_Y], planes.u, image.stride[VPX_PLANE_U],
                     planes.v, image.stride[VPX_PLANE_V], rgba.data(),
                     static_cast<int>(4 * place.width), static_cast<int>(place.width),
                     static_cast<int>(place.height));
}

bool same_canvas(const Region& a, const Region& b) {
  return a.canvas_x == b.canvas_x && a.canvas_y == b.canvas_y && a.canvas_width == b.canvas_width &&
         a.canvas_height == b.canvas_height;
}

/// Room for the subject to move in.
void lay_out_canvas(Region& region) {
  const auto grow = [](std::uint32_t at, std::uint32_t size, std::uint32_t& begin,
                       std::uint32_t& extent) {
    const std::uint32_t margin = std::max(16u, size / 8);
    begin = at > margin ? (at - margin) & ~15u : 0;
    extent = (at + size + margin - begin + 15) & ~15u;
  };
  grow(region.x, region.width, region.canvas_x, region.canvas_width);
  grow(region.y, region.height, region.canvas_y, region.canvas_height);
}

void set_canvas(Region& region, const Region& from) {
  region.canvas_x = from.canvas_x;
  region.canvas_y = from.canvas_y;
  region.canvas_width = from.canvas_width;
  region.canvas_height = from.canvas_height;
}

}  // namespace

struct VideoEncoder::State {
  Codec codec;
  std::unique_ptr<vpx_image_t, FreeImage> image;
  Region canvas;  // of the codec
  int quantizer = -1;
  bool alone = true;
  std::int64_t number = 0;
  std::vector<std::uint8_t> rgba, frame;
  double error = 0;

  void open();
  void put(const Region& region, const std::uint8_t* pixels);
  void compare(const Region& region, const std::uint8_t* pixels);
  [[noreturn]] void fail() {
    const std::string why = codec ? vpx_codec_error(codec.get()) : "no codec";
    codec.reset();
    throw Error(Error::Kind::io, "A picture could not be made VP8: {}.", why);
  }
};

void VideoEncoder::State::open() {
  codec.reset();
  vpx_codec_enc_cfg_t settings;
  vpx_codec_enc_config_default(vpx_codec_vp8_cx(), &settings, 0);
  settings.g_w = canvas.canvas_width;
  settings.g_h = canvas.canvas_height;
  settings.g_timebase = {1, 25};
  settings.g_threads = 1;  // each stream has its own already
  settings.g_lag_in_frames = 0;
  settings.kf_mode = VPX_KF_DISABLED;
  settings.rc_end_usage = VPX_VBR;
  settings.rc_target_bitrate = 1'000'000;  // kbit/s: the quantizer alone counts
  settings.rc_dropframe_thresh = 0;
  settings.rc_min_quantizer = settings.rc_max_quantizer = static_cast<unsigned>(quantizer);
  auto fresh = std::make_unique<vpx_codec_ctx_t>();
  if (vpx_codec_enc_init(fresh.get(), vpx_codec_vp8_cx(), &settings, 0) != VPX_CODEC_OK)
    throw Error(Error::Kind::io, "libvpx does not encode VP8 of {} x {} pixels: {}.", settings.g_w,
                settings.g_h, vpx_codec_error(fresh.get()));
  codec.reset(fresh.release());
  vpx_codec_control(codec.get(), VP8E_SET_CPUUSED, speed);
  image.reset(vpx_img_alloc(nullptr, VPX_IMG_FMT_I420, settings.g_w, settings.g_h, 32));
  if (!image) throw std::bad_alloc();
  // What lies outside the regions of interest is of no colour and costs nothing.
  for (int plane = 0; plane < 3; ++plane)
    std::memset(image->planes[plane], 128,
                static_cast<std::size_t>(image->stride[plane]) *
                    (plane == 0 ? settings.g_h : (settings.g_h + 1) / 2));
  alone = true;
}

void VideoEncoder::State::put(const Region& region, const std::uint8_t* pixels) {
  const Place place(region);
  rgba.resize(std::size_t{4} * place.width * place.height);
  const std::size_t row = std::size_t{4} * region.width;
  // The border of an odd region is its last row and column once more.
  for (std::uint32_t y = 0; y < place.height; ++y) {
    const std::uint32_t from =
        std::min(place.top + y > place.y ? place.top + y - place.y : 0, region.height - 1);
    const std::uint8_t* in = pixels + from * row;
    std::uint8_t* out = rgba.data() + std::size_t{4} * place.width * y;
    const std::uint32_t before = place.x - place.left;
    if (before > 0) std::memcpy(out, in, 4);
    std::memcpy(out + std::size_t{4} * before, in, row);
    if (before + region.width < place.width) std::memcpy(out + 4 * before + row, in + row - 4, 4);
  }
  const Planes planes(*image, place);
  libyuv::ABGRToJ420(rgba.data(), static_cast<int>(4 * place.width), planes.y,
                     image->stride[VPX_PLANE_Y], planes.u, image->stride[VPX_PLANE_U], planes.v,
                     image->stride[VPX_PLANE_V], static_cast<int>(place.width),
                     static_cast<int>(place.height));
}

void VideoEncoder::State::compare(const Region& region, const std::uint8_t* pixels) {
  const vpx_image_t* shown = vpx_codec_get_preview_frame(codec.get());
  if (shown == nullptr) fail();
  const Place place(region);
  to_rgba(*shown, place, rgba);
  std::uint64_t sum = 0;
  for (std::uint32_t y = 0; y < region.height; ++y) {
    const std::uint8_t* was = pixels + std::size_t{4} * region.width * y;
    const std::uint8_t* is =
        rgba.data() + std::size_t{4} * (std::size_t{place.width} * (y + place.y - place.top) +
                                        place.x - place.left);
    std::uint32_t row = 0;
    for (std::size_t i = 0; i < std::size_t{4} * region.width; ++i) {
      const int less = i % 4 == 3 ? 0 : was[i] - is[i];
      row += static_cast<std::uint32_t>(less * less);
    }
    sum += row;
  }
  error = static_cast<double>(sum);
}

VideoEncoder::VideoEncoder() : state_(std::make_unique<State>()) {}
VideoEncoder::~VideoEncoder() = default;
VideoEncoder::VideoEncoder(VideoEncoder&&) noexcept = default;
VideoEncoder& VideoEncoder::operator=(VideoEncoder&&) noexcept = default;

void VideoEncoder::begin_anew() {
  state_->alone = true;
}

bool VideoEncoder::encode(Region& region, const std::uint8_t* pixels, int quantizer) {
  State& s = *state_;
  Region wanted = region;
  lay_out_canvas(wanted);
  if (!fits_video(wanted)) return false;
  Region kept = region;
  set_canvas(kept, s.canvas);
  if (!s.codec || quantizer != s.quantizer || !fits_video(kept)) {
    s.canvas = wanted;
    s.quantizer = quantizer;
    s.open();
  }
  region.kind = RegionKind::video;
  set_canvas(region, s.canvas);
  s.put(region, pixels);
  const vpx_enc_frame_flags_t flags = std::exchange(s.alone, false) ? VPX_EFLAG_FORCE_KF : 0;
  if (vpx_codec_encode(s.codec.get(), s.image.get(), s.number++, 1, flags, VPX_DL_REALTIME) !=
      VPX_CODEC_OK)
    s.fail();
  s.frame.clear();
  vpx_codec_iter_t iterator = nullptr;
  while (const vpx_codec_cx_pkt_t* packet = vpx_codec_get_cx_data(s.codec.get(), &iterator)) {
    if (packet->kind != VPX_CODEC_CX_FRAME_PKT) continue;
    const auto* bytes = static_cast<const std::uint8_t*>(packet->data.frame.buf);
    s.frame.insert(s.frame.end(), bytes, bytes + packet->data.frame.sz);
  }
  if (s.frame.empty()) s.fail();
  region.video_size = static_cast<std::uint32_t>(s.frame.size());
  s.compare(region, pixels);
  return true;
}

Bytes VideoEncoder::frame() const {
  return state_->frame;
}

double VideoEncoder::error() const {
  return state_->error;
}

struct VideoDecoder::State {
  Codec codec;
  Region canvas;  // of the codec
  std::vector<std::uint8_t> rgba;

  void open(const Region& region) {
    codec.reset();
    auto fresh = std::make_unique<vpx_codec_ctx_t>();
    vpx_codec_dec_cfg_t settings{1, region.canvas_width, region.canvas_height};
    if (vpx_codec_dec_init(fresh.get(), vpx_codec_vp8_dx(), &settings, 0) != VPX_CODEC_OK)
      throw Error(Error::Kind::io, "libvpx does not decode VP8: {}.", vpx_codec_error(fresh.get()));
    codec.reset(fresh.release());
    canvas = region;
  }
};

VideoDecoder::VideoDecoder() : state_(std::make_unique<State>()) {}
VideoDecoder::~VideoDecoder() = default;
VideoDecoder::VideoDecoder(VideoDecoder&&) noexcept = default;
VideoDecoder& VideoDecoder::operator=(VideoDecoder&&) noexcept = default;

void VideoDecoder::begin_anew() {
  state_->codec.reset();
}

void VideoDecoder::decode(const Region& region, Bytes frame, std::uint8_t* pixels) {
  State& s = *state_;
  vpx_codec_stream_info_t told{};
  told.sz = sizeof told;
  const bool known =
      vpx_codec_peek_stream_info(vpx_codec_vp8_dx(), frame.data(),
                                 static_cast<unsigned>(frame.size()), &told) == VPX_CODEC_OK;
  const bool key = known && told.is_kf != 0;
  if (key) {
    // Looked at before libvpx makes room for it.
    if (told.w != region.canvas_width || told.h != region.canvas_height)
      refuse_packed("a video has another size than its canvas");
    if (!s.codec || !same_canvas(region, s.canvas)) s.open(region);
  }
  if (!s.codec || !same_canvas(region, s.canvas))
    refuse_packed("a video does not begin with a whole picture");
  if (vpx_codec_decode(s.codec.get(), frame.data(), static_cast<unsigned>(frame.size()), nullptr,
                       0) != VPX_CODEC_OK) {
    s.codec.reset();
    refuse_packed("a video's frame cannot be decoded");
  }
  int corrupted = 0;
  vpx_codec_control(s.codec.get(), VP8D_GET_FRAME_CORRUPTED, &corrupted);
  vpx_codec_iter_t iterator = nullptr;
  const vpx_image_t* image = vpx_codec_get_frame(s.codec.get(), &iterator);
  if (image == nullptr || corrupted != 0 || image->fmt != VPX_IMG_FMT_I420 ||
      image->d_w != region.canvas_width || image->d_h != region.canvas_height)
    refuse_packed("a video's frame is damaged");
  const Place place(region);
  to_rgba(*image, place, s.rgba);
  for (std::uint32_t y = 0; y < region.height; ++y) {
    std::uint8_t* to = pixels + std::size_t{4} * region.width * y;
    const std::uint8_t* from =
        s.rgba.data() + std::size_t{4} * (std::size_t{place.width} * (y + place.y - place.top) +
                                          place.x - place.left);
    for (std::uint32_t x = 0; x < region.width; ++x) std::memcpy(to + 4 * x, from + 4 * x, 3);
  }
}

}  // namespace polyhull
