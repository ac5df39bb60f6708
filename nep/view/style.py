"""The look of the page, live or saved."""

CSS = """
* { box-sizing: border-box; }
body { margin: 0; padding: 10px 16px; color: #1c1e24; background: #fff;
  font: 14px/1.4 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
h1 { font-size: 18px; margin: 0 0 6px; }
h2 { font-size: 14px; margin: 8px 0 4px; color: #555; }
h3 { font-size: 14px; margin: 8px 0 4px; }
.head { display: flex; gap: 20px; align-items: baseline; }
#problem, .problem { color: #b3261e; }
.bar { display: flex; gap: 10px; align-items: center; flex-wrap: wrap; margin-bottom: 6px; }
.bar .slider { flex: 1; min-width: 300px; }
.bar .dash-dropdown { width: 170px; }
.bar .dash-input-container { width: 300px; }
select#words { width: 300px; padding: 6px 8px; font: inherit; }
button { padding: 6px 12px; font: inherit; border: 1px solid #888; border-radius: 4px;
  background: #f4f4f4; cursor: pointer; }
#time { width: 150px; font-variant-numeric: tabular-nums; font-weight: 600; }
.main { display: flex; gap: 16px; align-items: flex-start; }
.maps { flex: 3; display: flex; gap: 8px; min-width: 0; }
.side { flex: 1; min-width: 0; }
.side[hidden] { display: none; }
.map { height: 56vh; min-height: 380px; border: 1px solid #e2e2e2; border-radius: 4px; }
.answers { flex: 2; display: flex; gap: 16px; max-height: 60vh; overflow-y: auto; }
.below { display: flex; gap: 20px; align-items: flex-start; margin-top: 8px; }
.below > div { flex: 1; min-width: 0; }
.below > .wide { flex: 2; }
table { border-collapse: collapse; font-size: 13px; }
td, th { text-align: left; padding: 2px 10px 2px 0; vertical-align: top; font-weight: normal; }
th { color: #777; }
td:first-child { font-variant-numeric: tabular-nums; white-space: nowrap; }
ul { margin: 0; padding-left: 18px; }
p { margin: 4px 0; }
"""

PAGE = (
    """<!DOCTYPE html>
<html lang="en">
<head>{%metas%}<title>{%title%}</title>{%favicon%}{%css%}
<style>"""
    + CSS
    + """</style></head>
<body>{%app_entry%}<footer>{%config%}{%scripts%}{%renderer%}</footer></body>
</html>
"""
)
