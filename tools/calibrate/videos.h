// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Videos of a board, one per camera, as folders of pictures.
#pragma once

#include <filesystem>
#include <string>

#include "studio/calibration/adjust.h"

namespace polyhull::calibrate_tool {

/// Whether videos (MKV, MP4, MOV, AVI, and what else FFmpeg reads) lie in \p folder. Throws Error: no such folder, folders
/// of pictures beside videos, two videos of one name.
bool holds_videos(const std::string& folder);

/// A folder for one run, gone with the object.
class ScratchFolder {
 public:
  ScratchFolder();  ///< throws Error where none can be made
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// Which frames of videos are of one instant.
enum class VideoStart {
  first_frames,  ///< all begin with one
  file_times,    ///< those of one time in their files: the first frames of some are missing
};

struct UnpackedVideos {
  std::string notes;           ///< what the user should know (turns, missing frames), a line each
  bool starts_differ = false;  ///< by their files' times the videos do not begin with one frame
};

/// Writes each frame that begins another \p seconds of each video of \p folder as a grey picture
/// into \p out: CAMERA/FRAME.png, where CAMERA is the video's name and FRAME its frame's number, its
/// time in the file by the videos' rate, from \p start on. Frames of one number are of one instant.
/// Pictures are as they are stored: a turn in the header, as phones write it, is not applied. Throws
/// Error, naming the video: it cannot be read, or its frames follow each other more than 1 % faster or slower than the others'.
UnpackedVideos unpack_videos(const std::string& folder, double seconds, const std::string& out,
                             VideoStart start, const calibration::Progress& progress);

}  // namespace polyhull::calibrate_tool
