// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Fill and key: what a composite over a background that is not opaque says to whoever puts it over
/// another picture.
///
/// Keyers, switchers and GStreamer's compositor mix codes; composites mix light. For a code g of the
/// picture below, both in 0..1 and per channel,
///
///   keyed:  K(g) = A F + (1 - A) g             A the key, F the fill's colour
///   direct: D(g) = composite over u(g),        u(g) = b B + (1 - b) g, the background B of alpha b
///                                              over that picture
///
/// A straight line cannot follow D, which is curved. Two of its points are free, the channels share A:
/// F makes K = D at the middle grey, g = `middle`; A is chosen so that elsewhere, too, K is near D:
///
///   ground, without the subject:  1 - A_0 = the mean slope of D_0 between the greys below and above;
///                                 b where nothing is done to the background; but no more than the
///                                 last line needs where that is nearly the same, for black shadows
///   subject, of coverage a and own colour C, over v = D_0(middle):
///                 A_1 = (sum (C - v)(D - v) + r a) / (sum (C - v)^2 + r)
///                                 so that its colour in the fill is nearest to C
///   A = 1 - (1 - A_0)(1 - A_1), but as large as 0 <= F <= 1 needs
///
/// What lies under the shadow in a transparent place is not known: the light that the subject takes is
/// set against what the lamps would give there, unshadowed, and what the surface scatters of both
/// cancels out. Light is multiplied by s = 1 - E_taken / E then (of their luminances), so that D(g)
/// goes through 0 and the fill is black, A = 1 - s' with s' = what s becomes in codes at the middle
/// grey.
///
/// Where b = 1 all this is the direct composite, to the bit.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/frame.h"

namespace polyhull {

/// Codes of the greys over which a composite is looked at; the second is the middle.
inline constexpr int fill_greys[3] = {64, 128, 192};

/// A pixel, RGBA bytes in a little-endian word, over a grey of that code: opaque. \p alpha is not
/// AlphaCoding::ignored.
std::uint32_t over_grey(std::uint32_t pixel, int grey, AlphaCoding alpha);

/// What is known of a pixel of the composite over the greys; RGBA words.
struct FillPixel {
  std::uint32_t background = 0;  ///< as it came
  std::uint32_t over[3] = {};    ///< over_grey() of it
  std::uint32_t ground[3] = {};  ///< what becomes of these without the subject
  std::uint32_t whole = 0;       ///< of the middle one with it
  float coverage = 0.0f;         ///< the subject's, 0..1
  Vec3f colour{0.0f};            ///< its own, sRGB codes 0..1; where it covers anything
};

/// The fill and key of it, an RGBA word of the coding \p alpha.
std::uint32_t fill_of(const FillPixel& pixel, AlphaCoding alpha);

/// Whether a pixel of \p part of an RGBA picture, rows \p stride bytes apart, is not opaque.
bool any_translucent(const std::uint8_t* pixels, std::ptrdiff_t stride, const Rectangle& part);

/// Makes an RGBA picture its own key: alpha becomes an opaque grey. Rows \p stride bytes apart.
void show_key(std::uint8_t* pixels, std::ptrdiff_t stride, int width, int height);

}  // namespace polyhull
