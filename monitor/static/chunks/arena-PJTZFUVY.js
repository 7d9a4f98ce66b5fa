import{a}from"./chunk-R7JMOMUD.js";import"./chunk-FPCBWDPQ.js";import"./chunk-OULW4S7M.js";import"./chunk-6DHFEWGX.js";export{a as Arena};
