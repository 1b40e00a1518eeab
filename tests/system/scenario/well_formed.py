"""Fails unless every element of an HTML page is closed in its order, and every id and attribute is there once."""
import html.parser
import sys

VOID = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr"}


class Elements(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.ids, self.seen = [], set(), 0

    def fail(self, words):
        sys.exit("line %d, column %d: %s" % (*self.getpos(), words))

    def handle_starttag(self, tag, attributes):
        self.handle_startendtag(tag, attributes)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.seen += 1
        names = [name for name, _ in attributes]
        if len(names) != len(set(names)):
            self.fail("<%s> has an attribute twice" % tag)
        for name, value in attributes:
            if name == "id" and value in self.ids:
                self.fail("id '%s' is there twice" % value)
            if name == "id":
                self.ids.add(value)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.fail("</%s> closes nothing that is open" % tag)


elements = Elements()
elements.feed(open(sys.argv[1], encoding="utf-8").read())
elements.close()
if elements.open:
    sys.exit("not closed: " + ", ".join(elements.open))
if elements.seen < 100:
    sys.exit("only %d elements" % elements.seen)
