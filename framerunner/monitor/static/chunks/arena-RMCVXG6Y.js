import{a}from"./chunk-XI23IK77.js";import"./chunk-KL5XDGOI.js";import"./chunk-3FZVYVTY.js";import"./chunk-T2ACLE3U.js";import"./chunk-MATSTXXN.js";import"./chunk-OULW4S7M.js";export{a as Arena};
