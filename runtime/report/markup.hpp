#pragma once
// Writes XML, SVG and HTML that is well-formed XML: every element closed, every attribute quoted, all text
// escaped. The program gives the names of elements and attributes; text and values may have any origin.
//
// Misuse (asserts): close() without an open element, take() with open elements.

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace hil::report {

struct Attribute {
  std::string_view name;
  std::string value;

  Attribute(std::string_view attribute, std::string text) : name(attribute), value(std::move(text)) {}
  Attribute(std::string_view attribute, const char* text) : name(attribute), value(text) {}
  /// Two decimals at most: pixels.
  Attribute(std::string_view attribute, double number);
};

/// "12.5", "-3", "0.25": at most two decimals, for coordinates.
std::string pixels(double value);

class Markup {
 public:
  using Attributes = std::initializer_list<Attribute>;

  Markup& open(std::string_view tag, Attributes attributes = {});
  Markup& close();
  /// <tag ...>text</tag>
  Markup& element(std::string_view tag, Attributes attributes, std::string_view text);
  Markup& element(std::string_view tag, std::string_view text) { return element(tag, {}, text); }
  /// <tag .../>: SVG shapes and the empty elements of HTML (meta, br).
  Markup& leaf(std::string_view tag, Attributes attributes = {});
  Markup& text(std::string_view text);
  /// Markup of the program, never text of another origin.
  Markup& raw(std::string_view markup);

  std::string take();

 private:
  void start(std::string_view tag, Attributes attributes);

  std::string out_;
  std::vector<std::string> open_;
};

}  // namespace hil::report
