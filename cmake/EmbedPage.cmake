# cmake -DPAGE=report.html -DSOURCE=page.cpp -P EmbedPage.cmake: a source file that
# returns the page as text (apps/report/page_template.h).
file(READ ${PAGE} bytes HEX)
string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
# Lines that tools can bear.
string(REPEAT "0x..," 16 line)
string(REGEX REPLACE "(${line})" "\\1\n" bytes "${bytes}")
file(WRITE ${SOURCE} "#include \"report/page_template.h\"

namespace {

constexpr unsigned char kPage[] = {
${bytes}};

} // namespace

std::string_view
holdfast::app::pageTemplate()
{
  return {reinterpret_cast<const char*>(kPage), sizeof(kPage)};
}
")
