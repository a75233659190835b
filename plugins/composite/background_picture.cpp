// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/background_picture.h"

#include "base/error.h"
#include "plugins/common/memory/recycling_allocator.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/composite/background_content.h"

namespace polyhull::element {

BackgroundPicture::BackgroundPicture(Statistics& statistics)
    : statistics_(statistics), allocator_(make_recycling_allocator()) {
  reset();
}

BackgroundPicture::~BackgroundPicture() {
  let_go();
  gst_object_unref(allocator_);
}

bool BackgroundPicture::set_format(const GstCaps* caps) {
  reset();
  g_autoptr(GstCaps) rgba = gst_caps_copy(caps);
  gst_caps_set_simple(rgba, "format", G_TYPE_STRING, "RGBA", nullptr);
  GstVideoInfo source, info;
  if (!gst_video_info_from_caps(&source, caps)) return false;
  // Matrix, range and chroma's place are those of the other format.
  if (GST_VIDEO_INFO_FORMAT(&source) != GST_VIDEO_FORMAT_RGBA)
    gst_structure_remove_fields(gst_caps_get_structure(rgba, 0), "colorimetry", "chroma-site",
                                nullptr);
  if (!gst_video_info_from_caps(&info, rgba)) return false;
  source_info_ = source;
  info_ = info;
  return true;
}

GstBuffer* BackgroundPicture::of(GstBuffer* frame) {
  g_autoptr(GstBuffer) source = frame;
  if (GST_VIDEO_INFO_FORMAT(&source_info_) == GST_VIDEO_FORMAT_RGBA)
    return g_steal_pointer(&source);
  g_autoptr(GstBuffer) picture = nullptr;
  if (source_ != nullptr && same_memory(source_, source)) {
    picture = gst_buffer_copy(picture_);
  } else {
    picture = converted(source);
    const bool can_come_again = !is_sole_owner(source);
    gst_buffer_replace(&source_, can_come_again ? source : nullptr);
    gst_clear_buffer(&picture_);
    if (can_come_again) picture_ = gst_buffer_copy(picture);
  }
  gst_buffer_copy_into(picture, source, static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_METADATA),
                       0, -1);
  return g_steal_pointer(&picture);
}

GstBuffer* BackgroundPicture::converted(GstBuffer* frame) {
  if (converter_ == nullptr) converter_ = gst_video_converter_new(&source_info_, &info_, nullptr);
  if (converter_ == nullptr)
    throw Error(Error::Kind::unsupported,
                "The background's video format {} cannot be converted. Put \"videoconvert ! "
                "video/x-raw,format=RGBA\" in front of composite's pad background.",
                GST_VIDEO_INFO_NAME(&source_info_));
  g_autoptr(GstBuffer) out = gst_buffer_new_allocate(allocator_, info_.size, nullptr);
  const MappedFrame from(source_info_, frame);
  const MappedFrame to(info_, out, GST_MAP_WRITE);
  gst_video_converter_frame(converter_, &from.frame(), const_cast<GstVideoFrame*>(&to.frame()));
  statistics_.count("backgrounds-converted");
  return g_steal_pointer(&out);
}

void BackgroundPicture::let_go() {
  gst_clear_buffer(&source_);
  gst_clear_buffer(&picture_);
  g_clear_pointer(&converter_, gst_video_converter_free);
}

void BackgroundPicture::reset() {
  let_go();
  // A GstVideoInfo of zeros may not be asked for its format.
  gst_video_info_init(&source_info_);
  gst_video_info_init(&info_);
}

}  // namespace polyhull::element
