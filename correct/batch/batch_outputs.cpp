#include "correct/batch/batch_outputs.h"

#include <utility>

#include "core/files/together.h"
#include "correct/batch/batch_files.h"
#include "correct/report/result_files.h"

namespace unrig {

void write_batch(const BatchResult& result, const std::string& output, const std::string& page) {
  const auto whole = [](std::string text) { return [text = std::move(text)](const TextSink& sink) { sink(text); }; };
  std::string html;
  if (!page.empty()) {
    ReportPage report_page(file_name(output));
    add_batch(report_page, result, file_name(output));
    html = report_page.html();
  }
  write_together({{output, whole(output.ends_with(".json") ? to_json(result) : to_csv(result))}, {page, whole(std::move(html))}});
}

}  // namespace unrig
