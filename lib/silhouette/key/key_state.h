// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a Keyer holds between frames. Internal.
#pragma once

#include <array>
#include <vector>

#include "silhouette/colours/local_colours.h"
#include "silhouette/colours/mixing.h"
#include "silhouette/key/closed_gaps.h"
#include "silhouette/key/edge_map.h"
#include "silhouette/key/key_signal.h"
#include "silhouette/pixels/chroma.h"
#include "silhouette/pixels/colour_kernels.h"
#include "silhouette/pixels/thread_memory.h"

namespace polyhull {
namespace silhouette {

/// What is nearly background or nearly foreground, made plain away from edges. Kernels silence only
/// whole blocks (see Ramp); a face that is nearly solid would show their outlines.
struct Quiet {
  bool active = false;                    ///< else whole blocks do: their steps are not seen
  std::uint8_t dark = 0;                  ///< alpha up to this is nearly background
  std::uint8_t bright = 255;              ///< alpha from this on is nearly foreground
  std::array<std::uint8_t, 256> value{};  ///< alpha far from edges; continuous in alpha
};

inline constexpr double most_clipped = 0.2;  ///< alpha that is clipped at either end at most
inline constexpr double most_spread = 0.1;  ///< alpha that the subject's least solid parts may lack

/// \p low and \p high: what is silenced in whole blocks, see Ramp.
Quiet quiet_for(std::uint8_t low, std::uint8_t high);

/// Silences the mixed blocks of columns [begin, end) of a row, except beside edges; \p begin is the
/// first column of a block. Reads and writes \p states.
void quieten_row(const Quiet& quiet, int begin, int end, std::uint8_t* alpha, BlockState* states);

}  // namespace silhouette

namespace silhouette {

/// What a pixel mixes: levels, or light in numbers 0..255.
struct Mixture {
  Vec3f screen, subject;
};

}  // namespace silhouette

struct Keyer::State {
  enum class Path : std::uint8_t {
    pixels,     // four-byte pixels as they come
    chroma,     // 8-bit Y'CbCr, chroma alone
    converted,  // row by row through RGBA
  };

  KeySettings settings;
  // settings.method, or difference for a key colour without hue.
  KeyMethod method = KeyMethod::soft;

  // Samples: kept until the settings they depend on, the frame's size or format change.
  KeyCalibration samples;
  double noise = 0.0;            // of the screen's signal, levels
  double unevenness = 0.0;       // of the screen's signal over the picture
  double unquiet = 0.0;          // the same and what varies within a tile of the screen
  double clip_of_subject = 0.0;  // of alpha at both ends, for a subject of many shades of spill
  double spread_inside = 0.0;    // by which the subject's least solid parts stay below alpha 1
  double screen_level = 0.0, foreground_level = 0.0;  // of the calibrated signal
  KeyColour key = KeyColour::green;                   // custom where the signal is turned to `hue`
  Rgb hue{0, 255, 0};                                 // of the custom or found key colour
  bool fresh_settings = true;                         // tables must be laid out again
  bool found = false;                                 // the picture has been sampled

  // Where the screen was sampled in the dark, how it was lit, to see when the light comes.
  struct Light {
    int screen = 0;    // of a few points: those with at least half of the screen's signal,
    int brighter = 0;  // and with clearly more than it
  };
  bool dark = false;
  int bright_frames = 0;  // in a row, since
  silhouette::KeySignal sampled_signal;
  Light light;

  std::uint64_t frame_number = 0;  // of the frame that was prepared, among all keyers'

  // The frame the tables are for.
  FrameFormat format = FrameFormat::rgba;
  int width = 0, height = 0;
  ColourMatrix matrix = ColourMatrix::bt601;
  bool full_range = false;
  ChromaSite site = ChromaSite::left;
  BayerOrder bayer = BayerOrder::bggr;
  SampleLayout layout{};

  Path path = Path::pixels;
  Rectangle active;
  silhouette::KeySignal plain;   // not calibrated
  silhouette::KeySignal signal;  // calibrated
  // From pixels to alpha.
  struct RowKey {
    silhouette::PixelForms forms{};
    silhouette::ChromaForms chroma{};
    silhouette::Ramp ramp{};
    silhouette::Bend bend{};
    bool operator==(const RowKey&) const = default;
  };
  RowKey whole;                     // of the whole picture
  double black = 0.0, white = 1.0;  // alpha at which ramps begin and end
  silhouette::Quiet quiet;

  // With local colours each tile has its own; tiles that share one are one span.
  struct Span {
    int begin = 0, end = 0;  // columns
    RowKey key;
    std::size_t beyond = 0;  // the first span behind it that has other forms
  };
  silhouette::LocalColours colours;
  bool subject_seen = false;  // and the spread of its signal
  silhouette::Mixing mixing;
  std::vector<silhouette::Mixture> mixtures;  // of each tile
  std::vector<Span> spans;                    // row of tiles by row of tiles
  std::vector<std::size_t> first_spans;  // of each row of tiles, and their number; empty: no spans
  silhouette::DifferenceRamp difference{};
  bool local = false;                    // base and gain differ from pixel to pixel
  std::vector<std::int16_t> base, gain;  // rows of whole blocks
  std::vector<std::uint8_t> plate;       // R, G, B, tolerance; rows of whole blocks
  std::vector<std::uint8_t> allowed;     // 255 where foreground may be; empty: everywhere
  std::vector<std::uint8_t> forced;      // 255 where foreground is forced; empty: nowhere

  // Learning the plate.
  int learning = 0, learned = 0;
  std::vector<float> sums;                  // R, G, B and their squares
  std::vector<std::uint8_t> learned_plate;  // R, G, B, tolerance per pixel

  Matte scratch;                // morphology
  Matte keyed;                  // mixed blocks and states of the last frame
  silhouette::ClosedGaps gaps;  // of the last frame that key() did
  silhouette::EdgeMap edges;    // of the last frame, where despills()

  std::size_t row_length() const {
    return static_cast<std::size_t>(blocks_across(width)) * matte_block;
  }
  void lay_out(const FrameView& frame);
  void calibrate();  // the signal for the samples
  void sample(const FrameView& frame);
  Light light_of(const FrameView& frame) const;
  // Whether most of a screen that was sampled in the dark is clearly brighter now, and has been for some
  // frames. Asked once for each.
  bool light_came(const FrameView& frame);
  void lay_out_screen();
  // Samples the frame's local colours and lays out the spans.
  void follow_colours(const FrameView& frame);
  void sample_colours(const FrameView& frame);
  void sample_rows(const FrameView& frame);
  void bend_whole();
  void learn_from_colours(const FrameView& frame, bool first_screen);
  RowKey key_of(const FrameView& frame, int column, int row) const;  // of a tile
  // Without a ramp.
  RowKey forms_for(const FrameView& frame, const silhouette::KeySignal& of) const;
  // \p spread: of the screen's signal beyond noise, levels.
  silhouette::Ramp ramp_for(double screen, double foreground, double unit,
                            double spread = 0.0) const;
  void lay_out_plate();
  void lay_out_masks();
  void learn(const FrameView& frame);
  KeyLack lack() const;
  // Takes the screen out of columns [x0, x1) of R, G, B, A pixels of row y, as far as they were keyed as showing it.
  void unmix_row(int y, int x0, int x1, std::uint8_t* pixels) const;
  // Which of the blocks [begin, end) of row y unmix_row() has to change: mixed ones, and empty ones so near to
  // others that mattes which are blurred later show them.
  void find_mixed(int y, int begin, int end, std::vector<std::uint8_t>& counts) const;
  void unmix_stretch(int y, int x0, int x1, std::uint8_t* pixels) const;
  void unmix_plate_row(int y, int x0, int x1, std::uint8_t* pixels) const;
  template <class Coding>
  void unmix_local_row(const Coding& coding, int y, int x0, int x1, std::uint8_t* pixels) const;
  // The variance of noise over that of the subject's colours.
  float doubt() const;
  bool straightens() const { return despills() && method == KeyMethod::soft; }
  bool despills() const { return settings.spill > 0.0 && method != KeyMethod::difference; }
  // How the settings have spill taken out; nothing, where not despills().
  silhouette::DespillForms despill() const;
  // Gives pixels of a row that closing brought back before a coloured plate the colours around them;
  // out: the row's RGBA in the region.
  void fill_gaps(const FrameView& frame, int y, const Rectangle& region,
                 const silhouette::DespillForms& despill, std::uint8_t* out) const;
  void pixel_alpha_row(const FrameView& frame, int y, int x0, int end, const RowKey& key,
                       std::uint8_t* alpha, BlockState* states) const;
  struct RowMemory;
  struct Stretch {
    int begin, end;  // columns
    const RowKey& key;
  };
  void begin_chroma(const FrameView& frame, const silhouette::ChromaRows& rows,
                    RowMemory& memory) const;
  // Whole blocks of a row.
  struct Part {
    int y, x0, end;
  };
  // Of each block, from block 0 on: block_empty where its rows of chroma can only give the screen, else block_mixed.
  const BlockState* screen_blocks(const FrameView& frame, const Part& part,
                                  RowMemory& memory) const;
  // What one row of chroma says of it.
  void screen_of_chroma(const FrameView& frame, int row, const Part& part, RowMemory& memory,
                        BlockState* states) const;
  static const std::int16_t* chroma_row(const FrameView& frame,
                                        const silhouette::ChromaForms& forms, int x0, int x1,
                                        RowMemory& memory);
  // Alpha of whole blocks by the soft method.
  void soft_span(const FrameView& frame, int y, const Stretch& stretch, RowMemory& memory,
                 std::uint8_t* alpha, BlockState* states) const;
  // Of whole blocks by their spans. Returns the last one's; begins with \p span at the earliest.
  std::size_t soft_spans(const FrameView& frame, const Part& part, std::size_t span,
                         RowMemory& memory, std::uint8_t* alpha, BlockState* states) const;
  void soft_row(const FrameView& frame, int y, int x0, int end, std::uint8_t* alpha,
                BlockState* states) const;
  // Signals of columns [x0, stop), x0 even; valid until the thread's next row.
  const std::int16_t* signal_row(const FrameView& frame, int y, int x0, int stop,
                                 const RowKey& key) const;
  void alpha_row(const FrameView& frame, int y, std::uint8_t* alpha, BlockState* states) const;
  void limited_row(const FrameView& frame, int y, std::uint8_t* alpha, BlockState* states) const;
};

namespace silhouette {

/// Grows (radius > 0) or shaves (radius < 0) a matte by that many px, its soft edge kept;
/// octagonal.
void grow(Matte& matte, double radius, Matte& scratch);

/// The q-quantile of at least one number; changes their order.
double quantile(std::vector<double>& v, double q);

/// Clears what of a row lies outside columns [x0, x1), or where \p allowed (null: everywhere) is 0.
void limit_row(std::uint8_t* row, int width, int x0, int x1, const std::uint8_t* allowed);

/// Fills rows of whole blocks with 255 where the pixel centre is inside the rings (even-odd).
void fill_polygon(const Rings& rings, int width, int height, std::vector<std::uint8_t>& plane);

}  // namespace silhouette
}  // namespace polyhull
