"""Write all documents that are generated: python -m tests.documents"""

from tests.documents.generated import ROOT, generated

for name, text in generated().items():
    path = ROOT / name
    if not path.exists() or path.read_text("utf-8") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
        print(name)
