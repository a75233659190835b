// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: the reader of OBJ files, and what is drawn of them.
#include <cmath>
#include <cstdlib>

#include "base/error.h"
#include "input_file.h"
#include "studio/figure/file_subject.h"

using namespace polyhull;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const std::string file =
        fuzz::input_file({reinterpret_cast<const char*>(data), size}, "subject.obj");
    const auto subject = load_subject(file, 0.0);
    SubjectFrame frame;
    subject->pose(1.0, frame);
    for (const std::uint32_t corner : subject->triangles())
      if (corner >= frame.positions.size()) std::abort();
    for (std::uint32_t t = 0; t < subject->triangles().size() / 3; ++t)
      subject->albedo(t, Vec3f(1.0f / 3.0f), 0.01f);
  } catch (const Error&) {
  }
  return 0;
}
