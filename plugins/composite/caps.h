// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The video formats of composite.
#pragma once

#include <gst/gl/gl.h>
#include <gst/gst.h>
#include <gst/video/video.h>

namespace polyhull::element {

/// Of a background that is taken as it is,
inline constexpr char picture_caps[] =
    "video/x-raw, format=(string)RGBA, width=(int)[1,16384], height=(int)[1,16384], "
    "framerate=(fraction)[0/1,2147483647/1]; "
    "video/x-raw(memory:GLMemory), format=(string)RGBA, width=(int)[1,16384], "
    "height=(int)[1,16384], framerate=(fraction)[0/1,2147483647/1], texture-target=(string)2D";

/// and of one that is converted: whatever GStreamer can.
inline constexpr char converted_caps[] =
    "video/x-raw, format=(string)" GST_VIDEO_FORMATS_ALL
    ", width=(int)[1,16384], height=(int)[1,16384], framerate=(fraction)[0/1,2147483647/1]";

/// Of the output: RGBA, and what encoders take. Its colours are told, since what is assumed where
/// nothing is said depends on the size.
inline constexpr char composite_output_caps[] =
    "video/x-raw, format=(string)RGBA, width=(int)[1,16384], height=(int)[1,16384], "
    "framerate=(fraction)[0/1,2147483647/1]; "
    "video/x-raw(memory:GLMemory), format=(string)RGBA, width=(int)[1,16384], "
    "height=(int)[1,16384], framerate=(fraction)[0/1,2147483647/1], texture-target=(string)2D; "
    "video/x-raw, format=(string){NV12,I420}, width=(int)[1,16384], height=(int)[1,16384], "
    "framerate=(fraction)[0/1,2147483647/1], colorimetry=(string)bt709, "
    "chroma-site=(string)mpeg2";

/// Whether the pictures of \p caps are in OpenGL's memory.
bool is_gl_caps(const GstCaps* caps);

/// What composite can make of a background \p info: the same picture in either kind of memory, the
/// background's own kind first; after them the video formats in system memory.
GstCaps* output_caps(const GstVideoInfo& info, bool background_on_gpu);

/// Answers what the background may be: any memory and format, RGBA first, with the size and rate that
/// those behind \p source take.
void answer_background_caps(GstPad* source, GstQuery* query);

}  // namespace polyhull::element
