import{a}from"./chunk-LEQDQIOB.js";import"./chunk-FIEYFFF3.js";import"./chunk-BOOWPZ4F.js";import"./chunk-T2ACLE3U.js";import"./chunk-MATSTXXN.js";import"./chunk-OULW4S7M.js";export{a as Arena};
