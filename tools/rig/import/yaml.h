// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// YAML as programs write it that are none of cv::FileStorage.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace polyhull::import {

/// The document that \p text is, whose heading may be OpenCV's %YAML:1.0, which is no directive of
/// YAML. Throws YAML::Exception.
YAML::Node parse_yaml(std::string text);

/// \p root, a map, as JSON that cv::FileStorage reads; what is tagged opencv-matrix becomes one.
/// Throws YAML::Exception for more than a dozen lists and maps within each other, for other keys
/// than words, and where it becomes much longer than a calibration is, by aliases.
std::string json_of_yaml(const YAML::Node& root);

}  // namespace polyhull::import
