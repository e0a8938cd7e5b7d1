"""The elements, addresses, texts and code of a page, to see what it would load and run."""

from html.parser import HTMLParser

ADDRESSED = {"src", "href", "xlink:href", "action", "data", "poster", "srcset", "formaction"}


class Page(HTMLParser):
    """The elements of a page with the names of their attributes, its addresses and its texts."""

    def __init__(self, text: str):
        super().__init__()
        self.elements: list[tuple[str, ...]] = []
        self.addresses: list[str] = []
        self.texts: list[str] = []
        self.code: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, *(name for name, _ in attrs)))
        self.addresses += [value or "" for name, value in attrs if name in ADDRESSED]
        self.texts += [value or "" for _, value in attrs]

    def handle_data(self, data):
        is_code = bool(self.cdata_elem) or self.elements[-1:] == [("style",)]
        (self.code if is_code else self.texts).append(data)
