// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any matte through blur, tracer and approximation. The rings must be sound.
#include <cstdio>
#include <cstdlib>

#include "support/mask_trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const polyhull::test::MaskTrial trial = polyhull::test::mask_from_bytes({data, size});
  const std::string fault = polyhull::test::fault_of(trial);
  if (!fault.empty()) {
    std::fprintf(stderr, "%s: %s\n", trial.describe().c_str(), fault.c_str());
    std::abort();
  }
  return 0;
}
