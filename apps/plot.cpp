#include "plot.h"

#include <fmt/printf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

namespace holdfast::app {
namespace {

// Sizes in px.
constexpr double kFont = 12.0;
constexpr double kPlotWidth = 440.0;
constexpr double kPlotHeight = 290.0;
constexpr double kGap = 18.0;
// Of a character of a proportional font, on the safe side.
constexpr double kCharacter = 0.62 * kFont;

// Okabe and Ito's colours, which people with colour blindness can tell apart.
// Beyond their eight, four darker ones.
constexpr std::array<const char*, 12> kColors{"#0072b2",
                                              "#d55e00",
                                              "#009e73",
                                              "#cc79a7",
                                              "#000000",
                                              "#e69f00",
                                              "#56b4e9",
                                              "#8a6d00",
                                              "#7b3294",
                                              "#a50026",
                                              "#1b7837",
                                              "#543005"};
constexpr const char* kGrey = "#999999";

std::string
escaped(const std::string& text)
{
  std::string result;
  for (const char c : text)
    result += c == '<' ? "&lt;" :
              c == '>' ? "&gt;" :
              c == '&' ? "&amp;" :
              c == '"' ? "&quot;" :
                         std::string(1, c);
  return result;
}

std::string
number(double value, const char* format = "%.6g")
{
  return fmt::sprintf(format, value);
}

// Hundredths of a px are enough.
std::string
px(double value)
{
  return number(value, "%.2f");
}

double
textWidth(const std::string& text)
{
  return kCharacter * static_cast<double>(text.size());
}

struct Point {
  double x, y;
};

std::string
text(const Point& at,
     const std::string& words,
     const std::string& anchor,
     double turn_degrees = 0.0,
     const std::string& weight = "normal")
{
  const std::string turn = turn_degrees == 0.0 ?
                               "" :
                               fmt::format(R"~( transform="rotate({} {} {})")~",
                                           px(turn_degrees),
                                           px(at.x),
                                           px(at.y));
  return fmt::format(
      R"(<text x="{}" y="{}" text-anchor="{}" font-weight="{}"{}>{}</text>)"
      "\n",
      px(at.x),
      px(at.y),
      anchor,
      weight,
      turn,
      escaped(words));
}

std::string
segment(const Point& a, const Point& b, const std::string& style)
{
  return fmt::format(R"(<line x1="{}" y1="{}" x2="{}" y2="{}" {}/>)"
                     "\n",
                     px(a.x),
                     px(a.y),
                     px(b.x),
                     px(b.y),
                     style);
}

// Distinct names of series in the order of their appearance.
std::vector<std::string>
legendNames(const Plot& plot)
{
  std::vector<std::string> names;
  for (const Panel& panel : plot.panels)
    for (const Series& series : panel.series)
      if (!series.name.empty() &&
          std::find(names.begin(), names.end(), series.name) == names.end())
        names.push_back(series.name);
  return names;
}

std::string
colorOf(const std::string& name, const std::vector<std::string>& names)
{
  if (name.empty())
    return kGrey;
  const auto index = std::find(names.begin(), names.end(), name) - names.begin();
  return kColors[static_cast<std::size_t>(index) % kColors.size()];
}

// The values along one axis, on its own scale (logarithms where it is logarithmic).
class Scale {
public:
  explicit Scale(const Axis& axis) : axis_(axis) {}

  bool shows(double value) const
  {
    return std::isfinite(value) && (!axis_.logarithmic || value > 0.0);
  }

  void include(double value)
  {
    if (!shows(value))
      return;
    low_ = std::min(low_, scaled(value));
    high_ = std::max(high_, scaled(value));
  }

  void finish()
  {
    if (!axis_.categories.empty()) {
      low_ = -0.5;
      high_ = static_cast<double>(axis_.categories.size()) - 0.5;
      return;
    }
    if (!(low_ <= high_)) {
      low_ = 0.0;
      high_ = 1.0;
    }
    // A margin, so that nothing lies on the frame; some extent where all are equal.
    const double margin =
        high_ > low_ ? 0.04 * (high_ - low_) : std::max(0.5 * std::abs(low_), 0.1);
    low_ -= margin;
    high_ += margin;
  }

  void setRange(double low, double high)
  {
    low_ = low;
    high_ = high;
  }
  double low() const
  {
    return low_;
  }
  double high() const
  {
    return high_;
  }
  double extent() const
  {
    return high_ - low_;
  }

  // 0 at the low end, 1 at the high end.
  double fraction(double value) const
  {
    return (scaled(value) - low_) / extent();
  }

  struct Tick {
    double fraction;
    std::string label;
  };

  std::vector<Tick> ticks() const
  {
    if (!axis_.categories.empty())
      return categoryTicks();
    return axis_.logarithmic ? logarithmicTicks() : linearTicks();
  }

private:
  double scaled(double value) const
  {
    return axis_.logarithmic ? std::log10(value) : value;
  }

  std::vector<Tick> categoryTicks() const
  {
    std::vector<Tick> ticks;
    for (std::size_t i = 0; i < axis_.categories.size(); ++i)
      ticks.push_back({fraction(static_cast<double>(i)), axis_.categories[i]});
    return ticks;
  }

  std::vector<Tick> linearTicks() const
  {
    const double rough = extent() / 6.0;
    const double decade = std::pow(10.0, std::floor(std::log10(rough)));
    const double first = rough / decade;
    const double step = decade * (first < 1.5 ? 1 :
                                  first < 3.5 ? 2 :
                                  first < 7.5 ? 5 :
                                                10);
    std::vector<Tick> ticks;
    for (double i = std::ceil(low_ / step); i * step <= high_; ++i)
      // 0.0 + x turns -0 into 0.
      ticks.push_back({(i * step - low_) / extent(), number(0.0 + i * step)});
    return ticks;
  }

  // Decades; 2 and 5 between them, or every digit, where there are few.
  std::vector<Tick> logarithmicTicks() const
  {
    const std::vector<int> digits = extent() > 2.5 ? std::vector<int>{1} :
                                    extent() > 0.8 ? std::vector<int>{1, 2, 5} :
                                                     std::vector<int>{1, 2, 3, 4, 5, 7};
    const int skip = std::max(1, static_cast<int>(std::ceil(extent() / 8.0)));
    std::vector<Tick> ticks;
    for (int decade = static_cast<int>(std::floor(low_)); decade <= high_; ++decade)
      for (const int digit : digits) {
        const double at = decade + std::log10(digit);
        if (at >= low_ && at <= high_ && decade % skip == 0)
          ticks.push_back(
              {(at - low_) / extent(), number(digit * std::pow(10.0, decade), "%g")});
      }
    return ticks;
  }

  const Axis& axis_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

class PanelWriter {
public:
  PanelWriter(const Panel& panel, const std::vector<std::string>& names)
  : panel_(panel), names_(names), x_(panel.x), y_(panel.y)
  {
    for (const Series& series : panel.series) {
      for (const double value : series.x)
        x_.include(value);
      for (const auto* values : {&series.y, &series.low, &series.high})
        for (const double value : *values)
          y_.include(value);
    }
    x_.finish();
    y_.finish();
    if (panel.equal_scales)
      equalize();
    measureMargins();
  }

  double width() const
  {
    return left_ + kPlotWidth + kGap;
  }
  double height() const
  {
    return top_ + kPlotHeight + bottom_;
  }

  void write(std::ostream& out, const Point& corner)
  {
    origin_ = {corner.x + left_, corner.y + top_};
    writeTicks(out);
    out << "<rect x=\"" << px(origin_.x) << "\" y=\"" << px(origin_.y) << "\" width=\""
        << px(kPlotWidth) << "\" height=\"" << px(kPlotHeight)
        << "\" fill=\"none\" stroke=\"#333333\"/>\n";
    for (const Series& series : panel_.series)
      writeBand(out, series);
    for (const Series& series : panel_.series)
      writeSeries(out, series);
    const double middle = origin_.x + 0.5 * kPlotWidth;
    out << text({middle, origin_.y - 0.7 * kFont}, panel_.title, "middle", 0.0, "bold")
        << text({middle, corner.y + height() - 0.5 * kFont}, panel_.x.label, "middle")
        << text({origin_.x - tick_width_ - 18.0, origin_.y + 0.5 * kPlotHeight},
                panel_.y.label,
                "middle",
                -90.0);
  }

private:
  // Widens the axis that has room, about its middle.
  void equalize()
  {
    const double unit = std::max(x_.extent() / kPlotWidth, y_.extent() / kPlotHeight);
    const auto widen = [unit](Scale& scale, double length) {
      const double middle = 0.5 * (scale.low() + scale.high());
      scale.setRange(middle - 0.5 * unit * length, middle + 0.5 * unit * length);
    };
    widen(x_, kPlotWidth);
    widen(y_, kPlotHeight);
  }

  void measureMargins()
  {
    double longest = 0.0;
    for (const Scale::Tick& tick : y_.ticks())
      tick_width_ = std::max(tick_width_, textWidth(tick.label));
    for (const Scale::Tick& tick : x_.ticks())
      longest = std::max(longest, textWidth(tick.label));
    turned_ = !panel_.x.categories.empty();
    top_ = 2.2 * kFont;
    left_ = 2.2 * kFont + tick_width_ + 10.0;
    bottom_ =
        turned_ ? longest * std::sin(kTurn * M_PI / 180.0) + 4.0 * kFont : 4.0 * kFont;
    // The first turned label reaches to the left of the frame.
    if (turned_)
      left_ = std::max(left_, longest);
  }

  Point at(double x, double y) const
  {
    const double v = y_.fraction(y);
    return {origin_.x + kPlotWidth * x_.fraction(x),
            origin_.y + kPlotHeight * (panel_.y.downwards ? v : 1.0 - v)};
  }

  void writeTicks(std::ostream& out) const
  {
    const std::string grid = "stroke=\"#dddddd\"";
    const double foot = origin_.y + kPlotHeight;
    for (const Scale::Tick& tick : x_.ticks()) {
      const double x = origin_.x + kPlotWidth * tick.fraction;
      out << segment({x, origin_.y}, {x, foot}, grid)
          << (turned_ ? text({x + 4.0, foot + kFont}, tick.label, "end", -kTurn) :
                        text({x, foot + 1.3 * kFont}, tick.label, "middle"));
    }
    for (const Scale::Tick& tick : y_.ticks()) {
      const double v = panel_.y.downwards ? tick.fraction : 1.0 - tick.fraction;
      const double y = origin_.y + kPlotHeight * v;
      out << segment({origin_.x, y}, {origin_.x + kPlotWidth, y}, grid)
          << text({origin_.x - 6.0, y + 0.35 * kFont}, tick.label, "end");
    }
  }

  void writeBand(std::ostream& out, const Series& series) const
  {
    const auto n = static_cast<std::ptrdiff_t>(series.low.size());
    std::string path;
    const auto add = [&](std::ptrdiff_t i, double y) {
      const double x = series.x[static_cast<std::size_t>(i)];
      if (!x_.shows(x) || !y_.shows(y))
        return;
      const Point p = at(x, y);
      path += px(p.x) + ',' + px(p.y) + ' ';
    };
    for (std::ptrdiff_t i = 0; i < n; ++i)
      add(i, series.high[static_cast<std::size_t>(i)]);
    for (std::ptrdiff_t i = n; i-- > 0;)
      add(i, series.low[static_cast<std::size_t>(i)]);
    if (!path.empty())
      out << "<polygon points=\"" << path << "\" fill=\""
          << colorOf(series.name, names_) << "\" fill-opacity=\"0.3\"/>\n";
  }

  // "M x y L x y ..." with a new start behind every gap.
  std::string pathOf(const Series& series) const
  {
    std::string path;
    bool gap = true;
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      const bool shown = x_.shows(series.x[i]) && y_.shows(series.y[i]);
      if (shown) {
        const Point p = at(series.x[i], series.y[i]);
        path += (gap ? 'M' : 'L') + px(p.x) + ' ' + px(p.y);
        if (series.style == SeriesStyle::Dots)
          path += "h0";
      }
      gap = !shown || series.style == SeriesStyle::Dots;
    }
    return path;
  }

  void writeSeries(std::ostream& out, const Series& series) const
  {
    const std::string color = colorOf(series.name, names_);
    if (series.style == SeriesStyle::Markers) {
      for (std::size_t i = 0; i < series.x.size(); ++i)
        if (x_.shows(series.x[i]) && y_.shows(series.y[i])) {
          const Point p = at(series.x[i], series.y[i]);
          out << "<circle cx=\"" << px(p.x) << "\" cy=\"" << px(p.y)
              << "\" r=\"3\" fill=\"" << color << "\"/>\n";
        }
      return;
    }
    const std::string path = pathOf(series);
    if (path.empty())
      return;
    out << "<path d=\"" << path << (series.style == SeriesStyle::Polygon ? "Z" : "")
        << "\" stroke=\"" << color << "\" " << styleAttributes(series.style) << "/>\n";
  }

  static std::string styleAttributes(SeriesStyle style)
  {
    switch (style) {
    case SeriesStyle::DashedLine:
      return "fill=\"none\" stroke-width=\"1.6\" stroke-dasharray=\"5 4\"";
    case SeriesStyle::Dots:
      return "fill=\"none\" stroke-width=\"1.2\" stroke-linecap=\"round\"";
    case SeriesStyle::Polygon:
      return "fill=\"" + std::string(kGrey) + "\" fill-opacity=\"0.15\"";
    case SeriesStyle::Line:
    case SeriesStyle::Markers:
      break;
    }
    return "fill=\"none\" stroke-width=\"1.6\"";
  }

  static constexpr double kTurn = 35.0; // of category labels, degrees

  const Panel& panel_;
  const std::vector<std::string>& names_;
  Scale x_;
  Scale y_;
  bool turned_ = false;
  double tick_width_ = 0.0, left_ = 0.0, top_ = 0.0, bottom_ = 0.0;
  Point origin_{0.0, 0.0};
};

// Lines of entries that fit into the width. \return its height.
double
writeLegend(std::ostream& out, const std::vector<std::string>& names, double width)
{
  constexpr double kSwatch = 18.0, kLine = 1.6 * kFont;
  double x = kGap, y = 1.5 * kFont;
  for (const std::string& name : names) {
    const double length = kSwatch + 6.0 + textWidth(name) + kGap;
    if (x > kGap && x + length > width) {
      x = kGap;
      y += kLine;
    }
    out << "<rect x=\"" << px(x) << "\" y=\"" << px(y - 0.6 * kFont) << "\" width=\""
        << px(kSwatch) << "\" height=\"6\" fill=\"" << colorOf(name, names) << "\"/>\n"
        << text({x + kSwatch + 6.0, y}, name, "start");
    x += length;
  }
  return names.empty() ? 0.0 : y + 0.8 * kFont;
}

} // namespace

void
writeSvg(std::ostream& out, const Plot& plot, const std::string& description)
{
  const std::vector<std::string> names = legendNames(plot);
  std::vector<PanelWriter> writers;
  for (const Panel& panel : plot.panels)
    writers.emplace_back(panel, names);
  double cell_width = 0.0, cell_height = 0.0;
  for (const PanelWriter& writer : writers) {
    cell_width = std::max(cell_width, writer.width());
    cell_height = std::max(cell_height, writer.height());
  }
  const auto columns = static_cast<std::size_t>(std::max(1, plot.columns));
  const std::size_t used = std::min(columns, writers.size());
  const std::size_t rows = (writers.size() + columns - 1) / columns;
  const double width = static_cast<double>(used) * (cell_width + kGap);
  std::ostringstream body;
  const double head = writeLegend(body, names, width);
  for (std::size_t i = 0; i < writers.size(); ++i)
    writers[i].write(body,
                     {static_cast<double>(i % columns) * (cell_width + kGap),
                      head + static_cast<double>(i / columns) * (cell_height + kGap)});
  const double height = head + static_cast<double>(rows) * (cell_height + kGap);
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << px(width)
      << "\" height=\"" << px(height) << "\" viewBox=\"0 0 " << px(width) << ' '
      << px(height) << "\" font-family=\"sans-serif\" font-size=\"" << kFont << "\">\n"
      << "<desc>" << escaped(description) << "</desc>\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      << body.str() << "</svg>\n";
}

} // namespace holdfast::app
