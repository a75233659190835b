// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: read_view() and read_view_times() on any bytes, and Instants with these times.
#include <cstdlib>

#include "base/error.h"
#include "mesh/instants.h"
#include "wire/view_payload.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using polyhull::Bytes, polyhull::Instants, polyhull::View;
  const Bytes bytes(data, size);
  try {
    const View times = polyhull::read_view_times({&bytes, 1});
    static const int cameras[2] = {};
    // What comes is from anywhere, hullbuild's own times are not.
    Instants instants;
    for (std::int64_t i = 0; i < 8; ++i) {
      const View view = i % 4 < 2 ? times : View();
      instants.place(&cameras[i % 2],
                     {40'000'000 * i, view.capture_time, view.clock, view.timecode},
                     {40'000'000 * i, 1'000'000'000, 40'000'000 * i, 1'700'000'000'000'000'000});
    }
  } catch (const polyhull::Error&) {
  }
  try {
    const polyhull::View view = polyhull::read_view(polyhull::Bytes(data, size));
    polyhull::validate_view(view);
    if (polyhull::write_view(view).empty()) std::abort();
  } catch (const polyhull::Error&) {
  }
  return 0;
}
