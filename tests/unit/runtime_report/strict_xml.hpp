#pragma once
// A strict reader of XML: no recovery, only predefined and numeric entities, no comments, no CDATA. It throws
// std::runtime_error with the byte of the first mistake.

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace hil::report::test {

struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::string text;  ///< without that of its children, with resolved references
  std::vector<XmlElement> children;

  /// This element and everything below it, in document order.
  std::vector<const XmlElement*> all() const;
  std::vector<const XmlElement*> all(std::string_view element_name) const;
  /// Text of this element and everything below it.
  std::string whole_text() const;
};

/// `document` may begin with an XML declaration or <!DOCTYPE html>.
XmlElement parse_strictly(std::string_view document);

}  // namespace hil::report::test
