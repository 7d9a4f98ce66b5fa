import{a}from"./chunk-SZWZE3GS.js";import"./chunk-CJAGQ4Q6.js";import"./chunk-5J55SXGN.js";import"./chunk-T2ACLE3U.js";import"./chunk-MATSTXXN.js";import"./chunk-OULW4S7M.js";export{a as Arena};
