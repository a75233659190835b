// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/coding_choice.h"

namespace polyhull {
namespace {

constexpr std::uint64_t between_trials = 50, first_trials = 3;  // pictures
constexpr double newest = 0.3;                                  // its part of what is known
constexpr double worth_changing = 0.95;

}  // namespace

bool CodingChoice::trial_due() {
  const std::uint64_t picture = pictures_++;
  return picture < first_trials || picture % between_trials == 0;
}

void CodingChoice::note(PixelCoding coding, const Trial& trial) {
  if (trial.raw_bytes == 0) return;
  Known& known = known_[static_cast<std::size_t>(coding)];
  const double part = known.tried ? newest : 1.0;
  const auto raw = static_cast<double>(trial.raw_bytes);
  const auto blend = [&](double& value, double now) { value += part * (now - value); };
  blend(known.share, static_cast<double>(trial.bytes) / raw);
  blend(known.pack, trial.pack_ms / raw);
  blend(known.unpack, trial.unpack_ms / raw);
  known.tried = true;
}

double CodingChoice::milliseconds(PixelCoding coding, std::size_t raw_bytes, double link) const {
  const Known& known = known_[static_cast<std::size_t>(coding)];
  const double per_byte = known.pack + known.unpack + known.share * 8e-3 / link;
  return per_byte * static_cast<double>(raw_bytes);
}

PixelCoding CodingChoice::choose(std::size_t raw_bytes, double link, bool with_loss) {
  const auto allowed = [&](PixelCoding coding) {
    return known_[static_cast<std::size_t>(coding)].tried &&
           (with_loss || coding != PixelCoding::jpeg);
  };
  PixelCoding best = PixelCoding::raw;
  for (const PixelCoding coding : {PixelCoding::lz4, PixelCoding::zstd, PixelCoding::jpeg})
    if (allowed(coding) &&
        milliseconds(coding, raw_bytes, link) < milliseconds(best, raw_bytes, link))
      best = coding;
  if (!allowed(last_) ||
      milliseconds(best, raw_bytes, link) < worth_changing * milliseconds(last_, raw_bytes, link))
    last_ = best;
  return last_;
}

}  // namespace polyhull
