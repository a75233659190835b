// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: polyhull-rig's readers of other programs' files; the first byte says which.
#include <cstdlib>
#include <filesystem>
#include <string>

#include "base/error.h"
#include "input_file.h"
#include "rig/import.h"

namespace {

using namespace polyhull;

Rig read(int format, const std::string& text) {
  if (format == 0) return import::parse_kalibr(text, "fuzz");
  if (format == 1) return {{import::parse_opentrackio(text, "fuzz", {})}};
  const std::string file = fuzz::input_file(text, "images.txt");
  import::Options options;
  options.width = options.height = 100;
  switch (format) {
    case 2:
      return import::middlebury(file, options);
    case 3:
      return import::projection_matrices({file}, options);
    case 4:
      return import::text(file, options);
    case 5:
      return import::opencv({file}, options);
    case 6:
      return import::bouguet({file}, options);
    default:
      fuzz::input_file("1 PINHOLE 640 480 600 600 320 240\n2 RADIAL 640 480 600 320 240 0.1 0\n",
                       "cameras.txt");
      return import::colmap(std::filesystem::path(file).parent_path().string(), options);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    if (read(data[0] % 8, text).cameras.empty()) std::abort();
  } catch (const polyhull::Error&) {
  }
  return 0;
}
