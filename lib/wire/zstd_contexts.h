// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// zstd's contexts as owned objects.
#pragma once

#include <zstd.h>

#include <memory>

namespace polyhull {

struct FreeZstd {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};
using ZstdPacker = std::unique_ptr<ZSTD_CCtx, FreeZstd>;
using ZstdUnpacker = std::unique_ptr<ZSTD_DCtx, FreeZstd>;

}  // namespace polyhull
