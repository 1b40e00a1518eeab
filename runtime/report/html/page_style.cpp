#include "runtime/report/html/page_style.hpp"

namespace hil::report {

std::string_view picture_style() {
  return R"css(
:root{color-scheme:light dark;--bg:#f6f7f7;--card:#ffffff;--ink:#1b2126;--soft:#59646d;--line:#dde2e5;--faint:#eef1f2;
--good:#1a7f4b;--bad:#b42318;--warn:#8a5a00;--accent:#2e6bb0;--bar:#7fa6d1;--road:#e4e7e9;--marking:#ffffff;
--static:#cdc7bb;--static-edge:#a39b8c;--vehicle:#9db8d6;--vehicle-edge:#2e6bb0;--ego:#f3c48a;--ego-edge:#a85a00;
--dot:#a4243b;--c0:#0b66a8;--c1:#c77700;--c2:#0a8a66;--c3:#b0468c;--c4:#3f9fd6;--c5:#c24a12;--c6:#7a6326;--c7:#7a828a}
@media (prefers-color-scheme:dark){:root{--bg:#131619;--card:#1a1e22;--ink:#e4e8ea;--soft:#9ba6ae;--line:#333a40;
--faint:#23282d;--good:#4fc48c;--bad:#ff8a80;--warn:#e2b24a;--accent:#7db6f2;--bar:#4d7bab;--road:#2b3136;
--marking:#59636b;--static:#4d483f;--static-edge:#7d7566;--vehicle:#36506d;--vehicle-edge:#86b6ea;--ego:#6b4a1f;
--ego-edge:#f0b265;--dot:#ff8fa3;--c0:#5cb0ee;--c1:#f0a73d;--c2:#3fc79e;--c3:#e08ac4;--c4:#8fd0f7;--c5:#f58a55;
--c6:#c9ad62;--c7:#aab2ba}}
svg text{font-family:system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;font-size:11px;fill:var(--soft);
font-variant-numeric:tabular-nums}
svg .strong{fill:var(--ink);font-weight:600}
svg .label{fill:var(--ink);paint-order:stroke;stroke:var(--card);stroke-width:3px;stroke-linejoin:round}
.paper{fill:var(--card)}
.grid{stroke:var(--faint);stroke-width:1}
.axis{stroke:var(--line);stroke-width:1}
.plot-area{fill:none;stroke:var(--line)}
.bar{fill:var(--bar)}
.mark{stroke:var(--ink);stroke-width:1}
.mark-p50{stroke-dasharray:2 2}
.mark-p99{stroke-dasharray:6 3}
.mark-limit{stroke:var(--bad);stroke-width:1.5}
.mark-limit-text{fill:var(--bad)!important;font-weight:600}
.land{fill:var(--faint)}
.ground{fill:none}
.road{fill:var(--road)}
.marking{fill:var(--marking);stroke:var(--line);stroke-width:.6}
.detector{fill:none;stroke:var(--good);stroke-width:1.2;stroke-dasharray:4 3}
.static{fill:var(--static);stroke:var(--static-edge)}
.pole{fill:var(--static-edge);stroke:var(--ink);stroke-width:.8}
.vehicle{fill:var(--vehicle);stroke:var(--vehicle-edge);stroke-width:1.2}
.ego{fill:var(--ego);stroke:var(--ego-edge);stroke-width:1.5}
.track{fill:none;stroke:var(--vehicle-edge);stroke-width:1.2;stroke-opacity:.75}
.track-ego{stroke:var(--ego-edge)}
.second{fill:none;stroke:var(--vehicle-edge);stroke-width:4.5;stroke-linecap:round}
.second-ego{stroke:var(--ego-edge)}
.fan{fill:var(--ego-edge);fill-opacity:.09;stroke:var(--ego-edge);stroke-opacity:.6;stroke-dasharray:5 4}
.hits{fill:none;stroke:var(--dot);stroke-width:2.4;stroke-linecap:round}
.moment{fill:none;stroke:var(--accent);stroke-width:8;stroke-linecap:round}
.series{fill:none;stroke-width:1.6;stroke-linejoin:round}
.dots{fill:none;stroke-width:5;stroke-linecap:round}
.cloud{fill:none;stroke-width:1.5;stroke-linecap:round}
.c0{stroke:var(--c0)}.c1{stroke:var(--c1)}.c2{stroke:var(--c2)}.c3{stroke:var(--c3)}
.c4{stroke:var(--c4)}.c5{stroke:var(--c5)}.c6{stroke:var(--c6)}.c7{stroke:var(--c7)}
.plate{fill:var(--card);fill-opacity:.88;stroke:var(--line)}
.rule{stroke:var(--ink);stroke-width:1.5;fill:none}
.rule-soft{stroke:var(--soft);stroke-width:1.2;fill:none;stroke-dasharray:4 3}
.ghost{fill:none;stroke:var(--soft);stroke-dasharray:3 3}
.arrow{fill:var(--ink)}
.on-phone{display:none}
.viewport path,.viewport rect{vector-effect:non-scaling-stroke}
.faulted{stroke-dasharray:5 3}
.reference{stroke-dasharray:2 3}
.band{stroke:none;fill:var(--accent);fill-opacity:.14}
.limit{fill:none;stroke:var(--bad);stroke-width:1.2;stroke-dasharray:7 4}
.single{fill:none;stroke-width:7;stroke-linecap:round}
.expected{fill:none;stroke:var(--ink);stroke-width:6;stroke-linecap:round}
.tolerance{fill:none;stroke:var(--ink);stroke-width:2;stroke-opacity:.55}
.limit-text{fill:var(--bad)!important}
.marker-failure{fill:none;stroke:var(--bad);stroke-width:2}
.marker-least-margin{fill:none;stroke:var(--ink);stroke-width:1.2;stroke-dasharray:2 3}
.marker-met{fill:none;stroke:var(--good);stroke-width:2}
.active-fault{fill:var(--bad);fill-opacity:.3;stroke:var(--bad)}
.active-stimulus{fill:var(--accent);fill-opacity:.25;stroke:var(--accent)}
.event{fill:none;stroke:var(--soft);stroke-width:1.2}
.cursor{fill:none;stroke:var(--ink);stroke-width:1}
.selection{fill:var(--accent);fill-opacity:.2;stroke:none}
.use{fill:var(--bar)}
.use-over{fill:var(--bad)}
.use-rest{fill:var(--faint)}
)css";
}

std::string_view page_style() {
  return R"css(
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--ink);font:15px/1.5 system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,
sans-serif}
main{max-width:1120px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:30px;line-height:1.2;margin:0}
h2{font-size:19px;margin:38px 0 10px}
h3{font-size:15px;margin:0 0 4px}
p{margin:6px 0;max-width:78ch}
.soft,figcaption,.facts dt{color:var(--soft)}
.small{font-size:13px}
dd,figcaption,li,h1,h3,p{overflow-wrap:anywhere}
td{overflow-wrap:break-word}
.verdict{background:var(--card);border:1px solid var(--line);border-left:8px solid var(--tone);border-radius:10px;
padding:20px 24px}
.verdict h1{color:var(--tone)}
.verdict .reason{font-size:18px;margin:6px 0 0}
.good{--tone:var(--good)}.bad{--tone:var(--bad)}.warn{--tone:var(--warn)}
.tone{color:var(--tone);font-weight:600}
.facts{display:grid;grid-template-columns:repeat(auto-fill,minmax(200px,1fr));gap:12px 24px;margin:18px 0 0}
.facts dt{font-size:12.5px}
.facts dd{margin:0}
.card{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:16px 18px;margin:12px 0}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:13.5px;font-variant-numeric:tabular-nums}
th{font-weight:600;text-align:left;color:var(--soft);font-size:12.5px;vertical-align:bottom}
th,td{padding:5px 10px 5px 0;border-bottom:1px solid var(--line)}
tbody tr:last-child td{border-bottom:0}
td{vertical-align:top}
.n{text-align:right;white-space:nowrap}
th.n{white-space:normal}
.n:first-child{width:1%}
.n+:not(.n){padding-left:16px}
.group{text-align:center;border-bottom:1px solid var(--line)}
.name{min-width:9em}
.nowrap{white-space:nowrap}
main svg:where(:not(.signal-plot,.viewport)){display:block;width:100%;height:auto}
.signal-plot{display:block;width:calc(100% - 122px);margin:8px 66px 0 56px;overflow:visible;touch-action:pan-y;
cursor:crosshair;user-select:none}
.tools{display:flex;gap:6px;justify-content:flex-end;align-items:baseline;margin:4px 0 0}
.tools button{font:13px system-ui,sans-serif;color:var(--ink);background:var(--card);border:1px solid var(--line);
border-radius:6px;padding:3px 10px;cursor:pointer}
.clock{font-size:13px;color:var(--soft);margin-right:auto;font-variant-numeric:tabular-nums}
.plain{list-style:none;padding:0}
:root:not(.scripted) .with-script{display:none}
.wide svg{min-width:680px}
.bar-cell{width:190px;min-width:150px}
.bar-cell svg{margin-top:2px}
.scroll+h3{margin-top:18px}
.first{padding-left:18px}
.pair{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(440px,100%),1fr));gap:8px 28px}
.panels img{width:100%}
.panels{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(310px,100%),1fr));gap:18px 26px}
figure{margin:0}
img{display:block;max-width:100%;height:auto}
figcaption{font-size:13px;margin-top:4px}
.chart-title{font-size:13px;color:var(--soft);margin:8px 0 0}
.key{white-space:nowrap;width:1%;padding-right:32px;color:var(--soft)}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;font-size:13px;color:var(--soft);margin:8px 0 0}
.legend svg{display:inline-block;width:12px;height:12px;margin-right:6px;vertical-align:-1px}
ul{margin:6px 0;padding-left:20px}
code{font:13px ui-monospace,SFMono-Regular,Menlo,Consolas,monospace}
footer{margin-top:40px;color:var(--soft);font-size:13px}
@media (max-width:640px){
main{padding:12px 10px 40px}
h1{font-size:26px}
h2{font-size:18px;margin:28px 0 8px}
.card{padding:12px}
.verdict{padding:14px 16px}
.facts{grid-template-columns:repeat(auto-fill,minmax(130px,1fr))}
.on-page{display:none}
.spare{display:none}
.on-phone{display:block}
.pair>div,.pair>.card{overflow-x:auto}
.pair svg{min-width:400px}
thead{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)}
table,tbody,tr{display:block}
tr{padding:7px 0;border-bottom:1px solid var(--line)}
tbody tr:last-child{border-bottom:0}
td,.n,.n:first-child,.n+:not(.n),.first,.key,.nowrap,.name,.bar-cell{display:grid;
grid-template-columns:7.5em minmax(0,1fr);gap:10px;
width:auto;min-width:0;padding:1px 0;border:0;text-align:left;white-space:normal}
td::before{content:attr(data-label);color:var(--soft);font-weight:400}
td:first-child{font-weight:600}
}
@media print{:root{--bg:#fff}body{font-size:12px}main{max-width:none;padding:0}
.card,.verdict,figure,tr{break-inside:avoid}h2,h3{break-after:avoid}.scroll{overflow:visible}.wide svg{min-width:0}
svg,.verdict{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)css";
}

}  // namespace hil::report
