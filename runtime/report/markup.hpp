#pragma once
// Writes XML, SVG and HTML of XML's strictness: every element closed, every attribute quoted, all text
// escaped. Elements and attributes are named by the program; text and values may come from anywhere.
//
// Misuse (asserts): closing what is not open, taking a document with elements still open.

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
  /// <tag .../>: SVG shapes and the elements of HTML that hold nothing (meta, br).
  Markup& leaf(std::string_view tag, Attributes attributes = {});
  Markup& text(std::string_view text);
  /// Markup of the program's own; never anything from outside.
  Markup& raw(std::string_view markup);

  std::string take();

 private:
  void start(std::string_view tag, Attributes attributes);

  std::string out_;
  std::vector<std::string> open_;
};

}  // namespace hil::report
