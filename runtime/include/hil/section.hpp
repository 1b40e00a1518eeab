#pragma once
// A section of the report that a module contributes: a title, a paragraph, images, pictures of measured
// points, plots of curves or bars, and tables. The report draws it without knowing the module.
//
// A double that is not known is NaN; files hold null for it and the page shows a dash. Threads: plain data.

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <hil/map.hpp>

namespace hil::contribution {

inline constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

/// A length of the picture's subject, drawn to scale as a line with its name.
struct Dimension {
  std::string name;
  double length_m = not_known;
};

/// Picture::subject: all points are the subject.
inline constexpr std::uint32_t no_subject = std::numeric_limits<std::uint32_t>::max();

/// Measured points seen along a horizontal direction, centred on the subject. All pictures of a section have
/// one scale.
struct Picture {
  std::string title{};
  std::string caption{};
  std::vector<std::string> entities{};    ///< names, by SensorPoint::entity
  std::uint32_t subject = 0;              ///< the entity that is measured
  std::array<double, 2> right{1.0, 0.0};  ///< unit vector in x, y that points to the right in the picture
  double outline_length_m = not_known;    ///< of a frame around the subject's points: its real length
  std::vector<Dimension> dimensions{};    ///< the first is drawn above the points, the others below
  std::vector<SensorPoint> points{};
};

/// The axis of a plot. On a logarithmic one, numbers of 0 or less are not drawn.
struct PlotAxis {
  std::string quantity{};
  std::string unit{};
  bool logarithmic = false;
};

/// One line of a plot, with a dot at each point. A point with a number that is not known interrupts the line.
/// In a plot of bars each point is a bar from 0.
struct Series {
  std::string name{};
  std::vector<std::array<double, 2>> points{};  ///< x and y
};

struct Plot {
  std::string title{};
  std::string caption{};
  PlotAxis x{};
  PlotAxis y{};
  std::vector<Series> series{};
  bool bars = false;  ///< instead of lines; neither axis is logarithmic
};

/// An image on the page.
struct ShownImage {
  std::string title{};
  std::string caption{};
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb{};  ///< sRGB, rows from the top, 3 * width * height; not in report.json
  /// A PNG file in base64, reduced to at most 640 * 480 pixels: the run makes it of `rgb`.
  std::string png{};
};

/// How a cell is shown.
enum class Mark : std::uint8_t { none, good, bad };

const char* to_string(Mark mark) noexcept;
std::optional<Mark> mark_from(const std::string& word);

struct Column {
  std::string title{};
  bool numeric = false;  ///< cells show their number, else their text
  std::string unit{};    ///< behind the number
  int decimals = 0;
};

struct Cell {
  std::string text{};
  double number = not_known;
  Mark mark = Mark::none;
};

/// One cell per column in each row.
struct Table {
  std::vector<Column> columns{};
  std::vector<std::vector<Cell>> rows{};
};

struct Section {
  std::string name{};  ///< of its pictures: "scan" for scan-1.svg; letters, digits and '_'
  std::string title{};
  std::string text{};
  std::vector<ShownImage> images{};
  std::vector<Picture> pictures{};
  std::vector<Plot> plots{};
  std::vector<Table> tables{};
};

}  // namespace hil::contribution
