// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/lens/lens_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/plain_text.h"
#include "base/whole_file.h"
#include "track/lens/lens_table_text.h"
#include "track/lens/monotone_cubic.h"

namespace polyhull {
namespace {

enum Quantity : std::size_t {
  at_focal_length,                    // mm
  at_widths,                          // the focal length in widths of the picture
  at_coefficients,                    // and seven more
  at_offset_x = at_coefficients + 8,  // mm
  at_offset_y,
  at_dioptres,  // the reciprocal of metres
  at_entrance,  // metres
};

/// A column's name, or its stem before the unit, and what its values may be, in metres where they are
/// lengths.
struct Column {
  const char* name;
  Quantity quantity;
  bool is_length;
  double least, most;
};

using lens_file::cells_of;
using lens_file::normalised_name;
using lens_file::number_of;
using lens_file::separator_of;
using lens_file::shown;
using lens_file::trimmed;

constexpr double no_limit = std::numeric_limits<double>::infinity();

constexpr Column lens_columns[] = {
    {"focal_length", at_focal_length, true, 1e-4, 100.0},
    {"hfov_deg", at_widths, false, 0.01, 179.0},
    {"k1", at_coefficients, false, -1e6, 1e6},
    {"k2", Quantity{at_coefficients + 1}, false, -1e6, 1e6},
    {"p1", Quantity{at_coefficients + 2}, false, -1e6, 1e6},
    {"p2", Quantity{at_coefficients + 3}, false, -1e6, 1e6},
    {"k3", Quantity{at_coefficients + 4}, false, -1e6, 1e6},
    {"k4", Quantity{at_coefficients + 5}, false, -1e6, 1e6},
    {"k5", Quantity{at_coefficients + 6}, false, -1e6, 1e6},
    {"k6", Quantity{at_coefficients + 7}, false, -1e6, 1e6},
    {"projection_offset_x", at_offset_x, true, -1.0, 1.0},
    {"projection_offset_y", at_offset_y, true, -1.0, 1.0},
    {"focus_distance", at_dioptres, true, 1e-3, no_limit},
    {"entrance_pupil", at_entrance, true, -100.0, 100.0},
};

constexpr std::pair<const char*, double> length_units[] = {
    {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}, {"in", 0.0254}, {"ft", 0.3048}};

constexpr double largest_encoder = 1e9;
/// Encoders' values that are nearer than this are the same.
constexpr double least_step = 1e-6;

constexpr char known_columns[] =
    "zoom, focus, focal_length_UNIT, hfov_deg, k1, k2, p1, p2, k3 to k6, projection_offset_x_UNIT, "
    "projection_offset_y_UNIT, focus_distance_UNIT and entrance_pupil_UNIT, where UNIT is mm, cm, "
    "m, in or ft";

/// A heading's column: an encoder (no quantity) or a quantity, and what its numbers are times.
struct Named {
  std::string name;
  const Column* column = nullptr;  // null: an encoder
  double unit = 1.0;
};

std::optional<Named> named(const std::string& name) {
  if (name == "zoom" || name == "focus") return Named{name, nullptr, 1.0};
  for (const Column& column : lens_columns) {
    if (!column.is_length && name == column.name) return Named{name, &column, 1.0};
    for (const auto& [unit, metres] : length_units)
      if (column.is_length && name == std::string(column.name) + "_" + unit)
        return Named{name, &column, metres};
  }
  return {};
}

/// \p value, which is within the column's range, as it is interpolated.
double as_interpolated(Quantity quantity, double value) {
  switch (quantity) {
    case at_focal_length:
    case at_offset_x:
    case at_offset_y:
      return 1000.0 * value;
    case at_widths:
      return 0.5 / std::tan(value * std::numbers::pi / 360.0);
    case at_dioptres:
      return 1.0 / value;
    default:
      return value;
  }
}

}  // namespace

/// Reads the lines of a file.
class LensTable::Reader {
 public:
  Reader(LensTable& table, const std::string& source) : table_(table), source_(source) {}

  void read(std::string_view text) {
    if (text.size() > largest_file)
      throw Error(Error::Kind::bad_input, "{}: a lens file has at most {} bytes, this one {}.",
                  source_, largest_file, text.size());
    const std::string plain = plain_text(std::string(text), source_);
    text = plain;
    while (!text.empty()) {
      ++line_;
      const std::size_t end = text.find('\n');
      read_line(text.substr(0, end));
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
    if (!heading_.empty()) end_table();
    if (table_.grids_.empty())
      fail("is empty; expected a heading such as 'zoom focal_length_mm' and rows below");
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { fail_in(line_, what); }
  [[noreturn]] void fail_in(std::size_t line, const std::string& what) const {
    throw Error(Error::Kind::bad_input, "{}, line {}: {}.", source_, line, what);
  }

  void read_line(std::string_view line) {
    if (line.find('\0') != std::string_view::npos)
      fail("holds bytes that are no text; save the lens file as UTF-8");
    line = trimmed(line.substr(0, line.find('#')));
    const char separator = separator_of(line);
    std::vector<std::string_view> cells = cells_of(line, separator);
    if (cells.empty() || line.starts_with("sep=")) return;  // a spreadsheet's
    const auto is_encoder = [](std::string_view cell) {
      const std::string name = normalised_name(cell);
      return name == "zoom" || name == "focus";
    };
    if (std::any_of(cells.begin(), cells.end(), is_encoder)) {
      if (!heading_.empty()) end_table();
      begin_table(cells, separator);
    } else if (heading_.empty()) {
      fail(
          "expected a heading that names the columns, 'zoom' or 'focus' among them, as in 'zoom "
          "focal_length_mm'");
    } else {
      read_row(cells_of(line, separator_));
    }
  }

  void begin_table(const std::vector<std::string_view>& cells, char separator) {
    heading_line_ = line_;
    separator_ = separator;
    grid_ = {};
    rows_.clear();
    for (const std::string_view cell : cells) {
      const auto found = named(normalised_name(cell));
      if (!found) fail(fmt::format("the column '{}' is none of {}", shown(cell), known_columns));
      heading_.push_back(*found);
      if (!found->column) {
        bool& by = found->name == "zoom" ? grid_.by_zoom : grid_.by_focus;
        if (std::exchange(by, true))
          fail(fmt::format("the column '{}' is there twice", found->name));
        continue;
      }
      const Quantity quantity = found->column->quantity;
      // A focal length is told once, in millimetres or by the field of view.
      const bool is_focal = quantity == at_focal_length || quantity == at_widths;
      if (told_[quantity] || (is_focal && (told_[at_focal_length] || told_[at_widths])))
        fail(fmt::format("what '{}' tells is told by an earlier column", found->name));
      told_[quantity] = grid_.tells[quantity] = true;
    }
    if (std::none_of(grid_.tells.begin(), grid_.tells.end(), [](bool tells) { return tells; }))
      fail(
          fmt::format("the heading has encoders alone; expected one or more of {}", known_columns));
  }

  void read_row(const std::vector<std::string_view>& cells) {
    if (cells.size() != heading_.size())
      fail(fmt::format("{} values, the heading in line {} names {} columns", cells.size(),
                       heading_line_, heading_.size()));
    if (++all_rows_ > most_rows) fail(fmt::format("more than {} rows", most_rows));
    double zoom = 0.0, focus = 0.0;
    Row row{};
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Named& name = heading_[i];
      const std::optional<double> value = number_of(cells[i]);
      if (!value)
        fail(fmt::format(
            "'{}' in the column {} is no number{}", shown(cells[i]), name.name,
            cells[i].find(',') == std::string_view::npos ? "" : "; decimals stand behind a point"));
      // A comma before three digits, as in 16,384: decimals, or thousands?
      if (!name.column && !cells[i].starts_with('0') &&
          cells[i].size() - std::min(cells[i].size(), cells[i].find(',')) == 4)
        fail(
            fmt::format("'{}' in the column {} may be thousands or decimals: write thousands "
                        "without a comma, decimals with a point",
                        shown(cells[i]), name.name));
      if (!name.column) {
        if (!(std::abs(*value) <= largest_encoder))
          fail(fmt::format("{} is beyond 1e9 in the column {}", shown(cells[i]), name.name));
        (name.name == "zoom" ? zoom : focus) = *value;
        table_.normalised_ = table_.normalised_ && *value >= 0.0 && *value <= 1.0;
        continue;
      }
      const double metres = *value * name.unit;
      if (!(metres >= name.column->least && metres <= name.column->most))
        fail(fmt::format("{} is out of range in the column {}, which is from {} to {}",
                         shown(cells[i]), name.name, name.column->least / name.unit,
                         name.column->most / name.unit));
      row[name.column->quantity] = as_interpolated(name.column->quantity, metres);
    }
    const auto [before, is_new] = rows_[zoom].try_emplace(focus, line_, row);
    if (!is_new) fail(fmt::format("line {} is of the same encoder values", before->second.first));
  }

  /// What is within least_step of the one before would make a slope of any size.
  void check_step(double before, double value, std::size_t line) const {
    if (value - before < least_step)
      fail_in(line,
              fmt::format("another row's encoder value is within {} of this one's", least_step));
  }

  void end_table() {
    if (rows_.empty()) fail_in(heading_line_, "there are no rows below the heading");
    const double lowest = std::numeric_limits<double>::lowest();
    double zoom_before = lowest;
    grid_.first_focus = no_limit;
    grid_.last_focus = lowest;
    for (const auto& [zoom, of_zoom] : rows_) {
      check_step(zoom_before, zoom, of_zoom.begin()->second.first);
      zoom_before = zoom;
      Curve curve;
      curve.zoom = zoom;
      for (const auto& [focus, row] : of_zoom) {
        if (!curve.focus.empty()) check_step(curve.focus.back(), focus, row.first);
        curve.focus.push_back(focus);
        curve.rows.push_back(row.second);
      }
      grid_.first_focus = std::min(grid_.first_focus, curve.focus.front());
      grid_.last_focus = std::max(grid_.last_focus, curve.focus.back());
      grid_.curves.push_back(std::move(curve));
    }
    table_.grids_.push_back(std::move(grid_));
    heading_.clear();
  }

  LensTable& table_;
  const std::string& source_;
  std::size_t line_ = 0, heading_line_ = 0, all_rows_ = 0;
  char separator_ = ' ';
  std::vector<Named> heading_;
  std::array<bool, quantities> told_{};  // by any table
  Grid grid_;
  std::map<double, std::map<double, std::pair<std::size_t, Row>>> rows_;  // with their lines
};

LensTable::LensTable(std::string_view text, const std::string& source) {
  static_assert(at_entrance + 1 == quantities);
  Reader(*this, source).read(text);
}

LensTable::Row LensTable::row_at(const Grid& grid, double zoom, double focus) {
  // Of the curves two on each side tell all that a monotone cubic needs.
  const auto after =
      std::upper_bound(grid.curves.begin(), grid.curves.end(), zoom,
                       [](double value, const Curve& curve) { return value < curve.zoom; });
  const std::ptrdiff_t at = after - grid.curves.begin();
  const auto begin = grid.curves.begin() + std::max<std::ptrdiff_t>(at - 2, 0);
  const auto end = grid.curves.begin() + std::min<std::ptrdiff_t>(at + 2, std::ssize(grid.curves));
  Row row{};
  for (std::size_t i = 0; i < quantities; ++i) {
    if (!grid.tells[i]) continue;
    std::vector<double> zooms, values;
    for (auto curve = begin; curve != end; ++curve) {
      std::vector<double> column;
      for (const Row& one : curve->rows) column.push_back(one[i]);
      zooms.push_back(curve->zoom);
      values.push_back(monotone_cubic(curve->focus, column, focus));
    }
    row[i] = monotone_cubic(zooms, values, zoom);
  }
  return row;
}

LensState LensTable::at(const LensEncoders& encoders) const {
  LensState lens;
  for (const Grid& grid : grids_) {
    if ((grid.by_zoom && !encoders.zoom) || (grid.by_focus && !encoders.focus)) {
      lens.blind = true;
      continue;
    }
    const double zoom = encoders.zoom.value_or(0.0), focus = encoders.focus.value_or(0.0);
    const Row row = row_at(grid, grid.by_zoom ? zoom : 0.0, grid.by_focus ? focus : 0.0);
    if (grid.by_zoom && (zoom < grid.curves.front().zoom || zoom > grid.curves.back().zoom))
      lens.outside = true;
    if (grid.by_focus && (focus < grid.first_focus || focus > grid.last_focus)) lens.outside = true;
    const auto tell = [&](std::size_t quantity, std::optional<double>& value) {
      if (grid.tells[quantity]) value = row[quantity];
    };
    tell(at_focal_length, lens.focal_length_mm);
    tell(at_widths, lens.focal_length_widths);
    tell(at_entrance, lens.entrance_pupil_m);
    if (grid.tells[at_dioptres])
      lens.focus_distance_m = 1.0 / std::max(row[at_dioptres], 1.0 / farthest_m);
    for (std::size_t i = 0; i < 2; ++i)
      if (grid.tells[at_offset_x + i]) {
        if (!lens.projection_offset_mm) lens.projection_offset_mm = Vec2(0.0);
        (*lens.projection_offset_mm)[static_cast<int>(i)] = row[at_offset_x + i];
      }
    for (std::size_t i = 0; i < 8; ++i)
      if (grid.tells[at_coefficients + i]) {
        lens.distortion.resize(std::max<std::size_t>(lens.distortion.size(), i < 5 ? 5 : 8));
        lens.distortion[i] = row[at_coefficients + i];
      }
  }
  return lens;
}

LensTable load_lens_table(const std::string& path) {
  const std::optional<std::string> text = whole_file(path, LensTable::largest_file + 1);
  if (!text)
    throw Error(Error::Kind::not_found,
                "Cannot read the lens file '{}'; check that it exists, is a file and may be read.",
                path);
  return LensTable(*text, path);
}

}  // namespace polyhull
