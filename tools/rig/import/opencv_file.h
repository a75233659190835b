// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a calibration file of OpenCV or of a program that uses it holds, under whichever of its
/// usual names.
#pragma once

#include <array>
#include <initializer_list>
#include <opencv2/core/persistence.hpp>
#include <string>
#include <vector>

namespace polyhull::import {

/// A file of cv::FileStorage (XML, YAML, JSON), or YAML or JSON with plain lists of numbers, as
/// Python writes them. Where it does not have what is asked for, functions throw Error (bad_input),
/// which names file and line.
class OpenCvFile {
 public:
  using Names = std::initializer_list<const char*>;

  /// Refuses what is no such file, ROS's, and coefficients of other models than OpenCV's ordinary one.
  explicit OpenCvFile(const std::string& path);

  const std::string& path() const { return path_; }

  [[noreturn]] void fail(const std::string& what) const;

  /// The first of the \p names that is there, with \p label before or behind it, as doubles in one
  /// piece; empty where none is. Capitals and underscores do not count.
  cv::Mat find(Names names, const std::string& label = "") const;

  /// find(), which must have as many numbers as one of \p sizes says; \p what names it in messages.
  cv::Mat need(Names names, std::initializer_list<std::size_t> sizes, const char* what,
               const std::string& label = "") const;

  /// Width and height of the pictures, of those with \p label; 0: the file does not say it.
  std::array<int, 2> picture_size(const std::string& label) const;

  /// Whether there is anything of that very \p name.
  bool has(const char* name) const { return !storage_[name].empty(); }

  /// The strings that are listed under \p name; none: there is no such list.
  std::vector<std::string> strings(const char* name) const;

  /// The coefficients k1 k2 p1 p2 k3 that are numbers of their own.
  std::vector<double> single_coefficients() const;

  /// Throws where coefficients stand under a name that was not asked for.
  void refuse_unread_distortion() const;

  /// Throws where the file's poses are those of a board, one for each picture.
  void refuse_board_poses() const;

 private:
  [[noreturn]] void fail_in(const cv::FileNode& node, const std::string& what) const;
  void open();
  void open_storage(const std::string& text, int flags, std::size_t lines_before);
  bool is_ros() const;
  std::string contents() const;
  int whole(Names names) const;
  cv::FileNode node_of(Names names, const std::string& label = "") const;
  void refuse_other_models() const;

  std::string path_, text_;
  cv::FileStorage storage_;
  mutable std::vector<std::string> read_;  // names of nodes
};

}  // namespace polyhull::import
