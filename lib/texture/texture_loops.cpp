// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/texture_loops.h"

#include "base/instruction_set.h"

namespace polyhull {

const TextureLoops& texture_loops() {
#if defined(__x86_64__)
  static const TextureLoops& chosen =
      may_use_avx2() ? avx2_texture_loops() : baseline_texture_loops();
  return chosen;
#else
  return baseline_texture_loops();
#endif
}

}  // namespace polyhull
