#include "runtime/report/markup.hpp"

#include <array>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "runtime/report/markup: %s\n", what);
  std::abort();
}

}  // namespace

std::string pixels(double value) {
  std::array<char, 400> buffer{};
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed, 2);
  std::string text(buffer.data(), end.ptr);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

Attribute::Attribute(std::string_view attribute, double number) : name(attribute), value(pixels(number)) {}

void Markup::start(std::string_view tag, Attributes attributes) {
  out_ += '<';
  out_ += tag;
  for (const Attribute& attribute : attributes) {
    out_ += ' ';
    out_ += attribute.name;
    out_ += "=\"" + escape_markup(attribute.value) + '"';
  }
}

Markup& Markup::open(std::string_view tag, Attributes attributes) {
  start(tag, attributes);
  out_ += ">\n";
  open_.emplace_back(tag);
  return *this;
}

Markup& Markup::close() {
  require(!open_.empty(), "close without an open element");
  out_ += "</" + open_.back() + ">\n";
  open_.pop_back();
  return *this;
}

Markup& Markup::element(std::string_view tag, Attributes attributes, std::string_view text) {
  start(tag, attributes);
  out_ += '>' + escape_markup(text) + "</";
  out_ += tag;
  out_ += ">\n";
  return *this;
}

Markup& Markup::leaf(std::string_view tag, Attributes attributes) {
  start(tag, attributes);
  out_ += "/>\n";
  return *this;
}

Markup& Markup::text(std::string_view text) {
  out_ += escape_markup(text);
  return *this;
}

Markup& Markup::raw(std::string_view markup) {
  out_ += markup;
  return *this;
}

std::string Markup::take() {
  require(open_.empty(), "document taken with an open element");
  return std::exchange(out_, {});
}

}  // namespace hil::report
