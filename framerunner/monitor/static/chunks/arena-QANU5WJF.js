import{a}from"./chunk-WH2G5BHS.js";import"./chunk-CJAGQ4Q6.js";import"./chunk-5J55SXGN.js";import"./chunk-T2ACLE3U.js";import"./chunk-MATSTXXN.js";import"./chunk-OULW4S7M.js";export{a as Arena};
